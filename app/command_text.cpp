#include "app/command_text.h"

namespace diorama {

std::string shellWord(const std::string& text) {
  constexpr const char* kPlain =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,:/@%";
  if (!text.empty() && text.find_first_not_of(kPlain) == std::string::npos) return text;
  std::string quoted = "'";
  for (char c : text) quoted += c == '\'' ? "'\\''" : std::string(1, c);
  return quoted + "'";
}

std::string shellLine(const std::vector<std::string>& words) {
  std::string line;
  for (const std::string& word : words) line += (line.empty() ? "" : " ") + shellWord(word);
  return line;
}

std::vector<std::string> repeatCommand(const RunArguments& arguments) {
  const RunArguments usual;
  std::vector<std::string> words = {"diorama",        "run",      arguments.input, "-o",
                                    arguments.output, "--method", arguments.method};
  const auto add = [&](const char* name, const std::string& value, const std::string& other) {
    if (value == other) return;
    words.emplace_back(name);
    words.push_back(value);
  };
  add("--initial", arguments.initial, usual.initial);
  add("--odometry", arguments.odometry, usual.odometry);
  add("--tracker", arguments.tracker, usual.tracker);
  add("--quality", arguments.quality, usual.quality);
  add("--frames", arguments.frames, usual.frames);
  add("--every", std::to_string(arguments.every), std::to_string(usual.every));
  add("--objects", arguments.objects, usual.objects);
  add("--options", arguments.options, usual.options);
  if (arguments.seed) add("--seed", std::to_string(*arguments.seed), "");
  for (const std::string& set : arguments.sets) add("--set", set, "");
  for (const std::string& expect : arguments.expects) add("--expect", expect, "");
  if (arguments.realtime) words.emplace_back("--realtime");
  if (arguments.no_video) words.emplace_back("--no-video");
  return words;
}

}  // namespace diorama
