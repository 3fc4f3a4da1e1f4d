// A database file: a line with name and version, a line with the SHA-256 of all that follows, then
// the content in binary, little-endian, in the order of ObjectDatabase.
#include <bit>
#include <cmath>
#include <cstring>

#include "core/errors.h"
#include "core/files.h"
#include "core/sha256.h"
#include "tracker/object_database.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

static_assert(std::endian::native == std::endian::little);

constexpr std::string_view kMagic = "diorama-object-database ";
// Of the format, and of what training draws: a database of other pictures is another one.
constexpr std::string_view kVersion = "3";
constexpr size_t kSumLength = 64;
constexpr const char* kTrainAgain = "make it again with `diorama train`";

class Writer {
 public:
  template <class T>
  void value(const T& v) {
    content_.append(reinterpret_cast<const char*>(&v), sizeof v);
  }
  void count(size_t n) { value(static_cast<uint64_t>(n)); }
  void text(const std::string& s) {
    count(s.size());
    content_ += s;
  }
  template <class Vector>
  void numbers(const Vector& v) {
    for (int i = 0; i < v.size(); ++i) value(v[i]);
  }
  void bytes(const std::vector<uint8_t>& v) { content_.append(v.begin(), v.end()); }
  const std::string& content() const { return content_; }

 private:
  std::string content_;
};

// Every length is checked against what is left before anything is allocated.
class Reader {
 public:
  Reader(std::string_view content, const fs::path& file) : left_(content), file_(file) {}

  template <class T>
  T value() {
    T v;
    std::memcpy(&v, take(sizeof v), sizeof v);
    return v;
  }
  size_t count(size_t bytes_each) {
    const uint64_t n = value<uint64_t>();
    if (n > left_.size() / bytes_each) fail();
    return static_cast<size_t>(n);
  }
  std::string text() {
    const size_t n = count(1);
    return std::string(take(n), n);
  }
  template <class Vector>
  void numbers(Vector& v) {
    for (int i = 0; i < v.size(); ++i) {
      v[i] = value<typename Vector::Scalar>();
      if (!std::isfinite(v[i])) fail();
    }
  }
  std::vector<uint8_t> bytes(size_t n) {
    const char* data = take(n);
    return {data, data + n};
  }
  void end() const {
    if (!left_.empty()) fail();
  }
  const char* take(size_t n) {
    if (n > left_.size()) fail();
    const char* data = left_.data();
    left_.remove_prefix(n);
    return data;
  }
  [[noreturn]] void fail() const {
    throw InputError(file_, "the database contradicts itself", kTrainAgain);
  }

 private:
  std::string_view left_;
  const fs::path& file_;
};

std::string contentOf(const ObjectDatabase& database) {
  Writer out;
  out.text(database.name);
  out.text(database.mesh_sha256);
  out.text(toString(database.kind));
  out.count(database.views.size());
  for (const SE3& T : database.views) {
    out.numbers(T.translation);
    out.numbers(T.rotation.coeffs());
  }
  out.count(database.features.size());
  for (const DatabaseFeature& feature : database.features) {
    out.numbers(feature.p_object);
    out.numbers(feature.normal);
    out.value(feature.view);
  }
  out.bytes(database.descriptors);
  out.count(database.looks.size());
  for (const DatabaseLook& look : database.looks) {
    out.numbers(look.direction);
    out.value(look.side_m);
    out.count(look.points.size());
    for (const Vector3f& p : look.points) out.numbers(p);
    for (const Vector3f& normal : look.normals) out.numbers(normal);
    for (const Rgb8& color : look.colors) out.bytes({color.r, color.g, color.b});
  }
  return out.content();
}

FeatureKind readKind(Reader& in) {
  const std::string kind = in.text();
  if (kind != "sift" && kind != "surf") in.fail();
  return featureKindFromString(kind);
}

SE3 readPose(Reader& in) {
  SE3 T;
  in.numbers(T.translation);
  in.numbers(T.rotation.coeffs());
  if (std::abs(T.rotation.norm() - 1) > 1e-6) in.fail();
  return T;
}

DatabaseLook readLook(Reader& in) {
  DatabaseLook look;
  in.numbers(look.direction);
  look.side_m = in.value<float>();
  if (!(look.side_m > 0 && look.side_m < 1e6f)) in.fail();
  look.points.resize(in.count(3 * sizeof(float)));
  for (Vector3f& p : look.points) in.numbers(p);
  look.normals.resize(look.points.size());
  for (Vector3f& normal : look.normals) in.numbers(normal);
  const std::vector<uint8_t> colors = in.bytes(3 * look.points.size());
  for (size_t i = 0; i < colors.size(); i += 3)
    look.colors.push_back({colors[i], colors[i + 1], colors[i + 2]});
  return look;
}

ObjectDatabase parseContent(std::string_view content, const fs::path& file) {
  Reader in(content, file);
  ObjectDatabase database;
  database.name = in.text();
  database.mesh_sha256 = in.text();
  database.kind = readKind(in);
  database.views.resize(in.count(7 * sizeof(double)));
  for (SE3& T : database.views) T = readPose(in);
  database.features.resize(in.count(6 * sizeof(float) + sizeof(int32_t)));
  for (DatabaseFeature& feature : database.features) {
    in.numbers(feature.p_object);
    in.numbers(feature.normal);
    feature.view = in.value<int32_t>();
    if (feature.view < 0 || static_cast<size_t>(feature.view) >= database.views.size()) in.fail();
  }
  database.descriptors =
      in.bytes(database.features.size() * static_cast<size_t>(descriptorSize(database.kind)));
  database.looks.resize(in.count(4 * sizeof(float) + sizeof(uint64_t)));
  for (DatabaseLook& look : database.looks) look = readLook(in);
  in.end();
  return database;
}

}  // namespace

void writeDatabase(const ObjectDatabase& database, const fs::path& file) {
  const std::string content = contentOf(database);
  std::string head(kMagic);
  head.append(kVersion).append("\n").append(sha256(content)).append("\n");
  writeFileAtomically(file, head + content);
}

ObjectDatabase readDatabase(const fs::path& file) {
  const std::string bytes = readFile(file);
  const std::string_view all = bytes;
  if (!all.starts_with(kMagic))
    throw InputError(file, "this is no object database", "`diorama train` makes one");
  const size_t line_end = all.find('\n');
  const std::string_view version =
      all.substr(kMagic.size(), std::min(line_end, kMagic.size() + 8) - kMagic.size());
  if (version != kVersion)
    throw InputError(file,
                     "the database has version `" + std::string(version) + "`, expected " +
                         std::string(kVersion),
                     kTrainAgain);
  const size_t content_at = line_end + 1 + kSumLength + 1;
  if (all.size() < content_at ||
      all.substr(line_end + 1, kSumLength) != sha256(all.substr(content_at)))
    throw InputError(file, "the database is damaged: its checksum does not fit", kTrainAgain);
  return parseContent(all.substr(content_at), file);
}

}  // namespace diorama
