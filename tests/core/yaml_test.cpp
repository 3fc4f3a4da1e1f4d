#include "core/yaml.h"

#include <gmock/gmock.h>

#include "core/options.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace)
using testing::HasSubstr;
using testing::StartsWith;

struct InnerOptions {
  double scale = 2;
  template <class V>
  void visit(V& v) {
    v("scale", scale, kPositive);
  }
};

struct SampleOptions {
  double sample_step_px = 8;
  int rounds = 3;
  bool silhouettes = true;
  std::string detector = "surf";
  double ratio = 0.75;
  InnerOptions inner;
  template <class V>
  void visit(V& v) {
    v("sample_step_px", sample_step_px, Range{1, 64});
    v("rounds", rounds, Range{1, 10});
    v("silhouettes", silhouettes);
    v("detector", detector);
    v("ratio", ratio, kFraction);
    v("inner", inner);
  }
};

SampleOptions read(const std::string& content, const std::vector<YamlOverride>& overrides = {}) {
  YamlMap map = parseYaml(content, "run.yaml", overrides);
  SampleOptions options;
  readOptions(map, "tracker", options);
  map.finish();
  return options;
}

std::string problemOf(const std::string& content) {
  return messageOf<InputError>([&] { read(content); });
}

TEST(Options, FieldsThatAreNotGivenKeepTheirDefaults) {
  const SampleOptions options =
      read("tracker: {rounds: 5, inner: {scale: 0.5}, silhouettes: false}");
  EXPECT_EQ(options.rounds, 5);
  EXPECT_EQ(options.sample_step_px, 8);
  EXPECT_EQ(options.inner.scale, 0.5);
  EXPECT_FALSE(options.silhouettes);
  EXPECT_EQ(read("").rounds, 3);
  EXPECT_EQ(read("tracker:").rounds, 3);
}

TEST(Options, UnknownKeysNameThePlaceAndTheNearestKey) {
  const std::string message = problemOf("tracker:\n  rounds: 2\n  sample_step: 9\n");
  EXPECT_THAT(message, StartsWith("run.yaml:3:3: unknown key `tracker.sample_step`; did you mean "
                                  "`sample_step_px`?"));
  EXPECT_THAT(problemOf("tracker: {inner: {scael: 1}}"), HasSubstr("did you mean `scale`?"));
  EXPECT_THAT(problemOf("traker: {}"), HasSubstr("did you mean `tracker`?"));
  EXPECT_THAT(problemOf("tracker: {zzzzzzzz: 1}"), HasSubstr("known here: "));
}

TEST(Options, WrongTypesAndRanges) {
  EXPECT_THAT(problemOf("tracker:\n  rounds: two"), StartsWith("run.yaml:2:11: `tracker.rounds`"));
  EXPECT_THAT(problemOf("tracker: {rounds: 2.5}"), HasSubstr("whole number"));
  EXPECT_THAT(problemOf("tracker: {rounds: 99999999999}"), HasSubstr("whole number"));
  EXPECT_THAT(problemOf("tracker: {rounds: 11}"), HasSubstr("between 1 and 10"));
  EXPECT_THAT(problemOf("tracker: {rounds: [1]}"), HasSubstr("whole number"));
  EXPECT_THAT(problemOf("tracker: {sample_step_px: .nan}"), HasSubstr("must be"));
  EXPECT_THAT(problemOf("tracker: {sample_step_px: nan}"), HasSubstr("finite"));
  EXPECT_THAT(problemOf("tracker: {sample_step_px: inf}"), HasSubstr("finite"));
  EXPECT_THAT(problemOf("tracker: {sample_step_px: 0.5}"), HasSubstr("between 1 and 64"));
  EXPECT_THAT(problemOf("tracker: {silhouettes: 3}"), HasSubstr("true or false"));
  EXPECT_THAT(problemOf("tracker: {detector: {a: 1}}"), HasSubstr("text"));
  EXPECT_THAT(problemOf("tracker: {ratio: -0.1}"), HasSubstr("between 0 and 1"));
  EXPECT_THAT(problemOf("tracker: {inner: {scale: 0}}"), HasSubstr("above 0"));
  EXPECT_THAT(problemOf("tracker: {inner: 3}"), HasSubstr("mapping"));
  EXPECT_THAT(problemOf("tracker: 3"), HasSubstr("mapping"));
  EXPECT_THAT(problemOf("tracker: {rounds: 2, rounds: 3}"), HasSubstr("twice"));
  EXPECT_THAT(problemOf("tracker: {}\ntracker: {}"),
              HasSubstr("run.yaml:2:1: `tracker` stands twice"));
}

TEST(Options, WriteAndReadBack) {
  SampleOptions options;
  options.sample_step_px = 0.1 + 7;
  options.detector = "a: b # c";
  options.inner.scale = 1e-9;
  options.silhouettes = false;
  YAML::Emitter out;
  out << YAML::BeginMap;
  writeOptions(out, "tracker", options);
  out << YAML::EndMap;
  const SampleOptions back = read(out.c_str());
  EXPECT_EQ(back.sample_step_px, options.sample_step_px);
  EXPECT_EQ(back.detector, options.detector);
  EXPECT_EQ(back.inner.scale, options.inner.scale);
  EXPECT_EQ(back.silhouettes, options.silhouettes);
}

TEST(Overrides, ReplaceAndAddValuesBeforeTheyAreChecked) {
  const SampleOptions options =
      read("tracker: {rounds: 5}",
           {parseOverride("tracker.rounds=7"), parseOverride("tracker.inner.scale=3")});
  EXPECT_EQ(options.rounds, 7);
  EXPECT_EQ(options.inner.scale, 3);
  EXPECT_THROW(read("", {parseOverride("tracker.round=7")}), InputError);
  EXPECT_THROW(read("", {parseOverride("tracker.rounds=many")}), InputError);
}

TEST(Overrides, MakeMappingsOnTheWay) {
  YamlMap map = parseYaml("a:\nl: [1, 2]", "f",
                          {parseOverride("a.b.c=1"), parseOverride("x.y.z=[1, 2]"),
                           parseOverride("x.y.w=t"), parseOverride("l.0=9")});
  EXPECT_EQ(map.require("a").asMap().require("b").asMap().require("c").asInt(), 1);
  YamlMap y = map.require("x").asMap().require("y").asMap();
  EXPECT_EQ(y.require("z").asDoubles().size(), 2u);
  EXPECT_EQ(y.require("w").asString(), "t");
  EXPECT_EQ(map.require("l").asDoubles(), (std::vector<double>{9, 2}));
}

TEST(Overrides, ListsAndBadOnes) {
  YamlMap map = parseYaml("list: [{a: 1}, {a: 2}]", "f", {parseOverride("list.1.a=5")});
  EXPECT_EQ(map.require("list").asList()[1].asMap().require("a").asInt(), 5);
  for (const char* bad : {"", "=1", "a", ".a=1", "a..b=1", "a.=1"})
    EXPECT_THROW(parseOverride(bad), UsageError) << bad;
  EXPECT_EQ(parseOverride("a.b==x").value, "=x");
  for (const char* bad :
       {"list.7.a=1", "list.x.a=1", "list.x=1", "list.9=1", "a=[1", "n.b=1", "a=*x"})
    EXPECT_THROW(parseYaml("{list: [{a: 1}], n: 3}", "f", {parseOverride(bad)}), UsageError) << bad;
}

TEST(Yaml, ValuesOfEachKind) {
  YamlMap map = parseYaml("{b: yes, i: -3, u: 18, d: 1e-3, s: text, v: [1, 2, 3], c: blue}", "f");
  EXPECT_TRUE(map.require("b").asBool());
  EXPECT_EQ(map.require("i").asInt(), -3);
  EXPECT_EQ(map.require("u").asUint64(), 18u);
  EXPECT_EQ(map.require("d").asDouble(), 1e-3);
  EXPECT_EQ(map.require("v").asVector3(), Vector3d(1, 2, 3));
  EXPECT_EQ(map.require("c").asChoice({"red", "blue"}), 1u);
  EXPECT_FALSE(map.find("none"));
  EXPECT_THAT(messageOf<InputError>([&] { map.require("none"); }),
              HasSubstr("lacks the key `none`"));
  EXPECT_THAT(messageOf<InputError>([&] {
                map.require("c").asChoice({"red", "blues"});
              }),
              HasSubstr("did you mean `blues`?"));
  EXPECT_THROW(map.require("i").asUint64(), InputError);
  EXPECT_THROW(map.require("v").asInt(), InputError);
  EXPECT_THROW(map.require("v").asMap(), InputError);
  EXPECT_THROW(map.require("s").asList(), InputError);
  YamlMap short_vector = parseYaml("v: [1, 2]", "f");
  EXPECT_THROW(short_vector.require("v").asVector3(), InputError);
}

TEST(Yaml, MalformedFilesAreOneLineWithAPlace) {
  for (const char* bad : {"a: [1, 2",
                          "a: {b: 1",
                          "a: 'x",
                          "- a\n- b",
                          "a: b: c",
                          "just text",
                          "\t",
                          "3",
                          "a: *nothing",
                          "%",
                          "{",
                          "a: &x [*x",
                          "? [a, b]\n: 1",
                          "[1]: 2",
                          "\"",
                          "---\n- 1",
                          "a:\n\t- b",
                          "!!binary x",
                          "a: !<",
                          "@",
                          "`"}) {
    std::string message;
    try {
      YamlMap map = parseYaml(bad, "f.yaml");
      map.finish();
      continue;  // an empty mapping is fine
    } catch (const InputError& error) {
      message = error.what();
    }
    EXPECT_THAT(message, StartsWith("f.yaml:")) << bad;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
}

TEST(Yaml, DeepNestingIsRefused) {
  for (const char* open : {"[", "{a: ", "- ", "a:\n "}) {
    std::string deep;
    for (int i = 0; i < 200'000; ++i) deep += open;
    EXPECT_THROW(parseYaml("x: " + deep, "f").finish(), InputError) << open;
    EXPECT_THROW(parseYaml(deep, "f").finish(), InputError) << open;
  }
  std::string staircase;
  for (int i = 0; i < 3000; ++i) staircase += std::string(static_cast<size_t>(i), ' ') + "a:\n";
  EXPECT_THROW(parseYaml(staircase, "f").finish(), InputError);
}

TEST(Yaml, BinaryAndLargeFiles) {
  EXPECT_THROW(parseYaml(std::string("\0\1\2\3\xff\xfe", 6), "f").finish(), InputError);
  std::string large;
  for (int i = 0; i < 20'000; ++i) large += "k" + std::to_string(i) + ": 1\n";
  EXPECT_THROW(parseYaml(large, "f").finish(), InputError);  // unknown keys
  EXPECT_THROW(loadYaml("/nowhere/scene.yaml"), MissingInputError);
}

// A few hundred bytes that would be a billion values.
TEST(Yaml, AliasesDoNotExplode) {
  std::string bomb = "a0: &a0 [x, x, x, x, x, x, x, x, x, x]\n";
  for (int i = 1; i < 10; ++i) {
    const std::string last = "*a" + std::to_string(i - 1);
    bomb += "a" + std::to_string(i) + ": &a" + std::to_string(i) + " [" + last;
    for (int k = 0; k < 9; ++k) bomb += ", " + last;
    bomb += "]\n";
  }
  EXPECT_THROW(parseYaml(bomb, "f").finish(), InputError);  // unknown keys, at once
}

}  // namespace
}  // namespace diorama
