// Baked light is kept between runs, in a file named after all that it depends on.
#include <array>
#include <bit>
#include <cstring>
#include <string>

#include "core/errors.h"
#include "core/files.h"
#include "sim/light_baker.h"
#include "sim/light_grid.h"

namespace diorama {
namespace {

constexpr uint64_t kVersion = 6;  // of the baker and the file; a change makes old files unknown
constexpr char kMagic[8] = {'D', 'I', 'O', 'L', 'I', 'G', 'H', 'T'};

// Two 64-bit mixing chains over whole words: quick, and without an adversary good enough.
class ContentHash {
 public:
  void add(const void* data, size_t size) {
    const char* bytes = static_cast<const char*>(data);
    addWord(size);
    for (; size >= 8; size -= 8, bytes += 8) {
      uint64_t word;
      std::memcpy(&word, bytes, 8);
      addWord(word);
    }
    uint64_t rest = 0;
    std::memcpy(&rest, bytes, size);
    addWord(rest);
  }
  template <class T>
  void addAll(const std::vector<T>& values) {
    static_assert(std::has_unique_object_representations_v<T> || std::is_floating_point_v<T> ||
                  std::is_same_v<T, Vector3f>);
    add(values.data(), values.size() * sizeof(T));
  }
  template <class T>
  void addValue(T value) {
    add(&value, sizeof value);
  }
  std::array<uint64_t, 2> value() const { return {a_, b_}; }

 private:
  void addWord(uint64_t word) {
    a_ = (a_ ^ word) * 0x9E3779B97F4A7C15ull;
    a_ ^= a_ >> 29;
    b_ = (std::rotl(b_, 23) + word) * 0xBF58476D1CE4E5B9ull;
    b_ ^= b_ >> 32;
  }
  uint64_t a_ = 1469598103934665603ull, b_ = 0x94D049BB133111EBull;
};

void addMaterial(ContentHash& hash, const ShadingMaterial& m) {
  hash.add(m.tint, sizeof m.tint);
  hash.add(m.emission, sizeof m.emission);
  hash.addValue(m.texture.base);
  hash.addValue(m.texture.log_width);
  hash.addValue(m.texture.log_height);
}

std::array<uint64_t, 2> contentHash(const RenderScene& scene, const LightBakerOptions& o) {
  ContentHash hash;
  hash.addValue(kVersion);
  hash.addAll(scene.corners);
  hash.addAll(scene.indices);
  hash.addAll(scene.textures.texels());
  hash.addAll(scene.is_lamp);
  for (const ShadingTriangle& t : scene.triangles) {
    hash.add(t.normal0, offsetof(ShadingTriangle, light_offset));
    hash.addValue(t.material);
    hash.addValue(t.instance);
  }
  for (const ShadingMaterial& m : scene.materials) addMaterial(hash, m);
  for (const RectangleLight& l : scene.lights) {
    for (const Vector3f& v : {l.center, l.axis_u, l.axis_v, l.normal, l.radiance})
      hash.add(v.data(), sizeof(float) * 3);
    for (const float x : {l.half_u, l.half_v, l.body_m}) hash.addValue(x);
  }
  hash.add(scene.sky.data(), sizeof(float) * 3);
  for (const double x : {o.spacing_m, o.spacing_growth, static_cast<double>(o.surface_offset_m)})
    hash.addValue(x);
  for (const int x : {o.max_samples, o.shadow_rays, o.bounces, o.bounce_rays, o.last_bounce_rays})
    hash.addValue(x);
  return hash.value();
}

struct Header {
  char magic[8];
  std::array<uint64_t, 2> content;
  uint64_t count;
  std::array<uint64_t, 2> samples;  // hash of what follows: all light, then the bounced part
  float max, typical;
};

std::array<uint64_t, 2> hashOf(const LightMap& map) {
  ContentHash hash;
  hash.addAll(map.samples);
  hash.addAll(map.bounced);
  return hash.value();
}

std::string hex(const std::array<uint64_t, 2>& value) {
  char text[33];
  std::snprintf(text, sizeof text, "%016lx%016lx", value[0], value[1]);
  return text;
}

bool load(const std::filesystem::path& file, const std::array<uint64_t, 2>& content,
          size_t expected, LightMap& map) {
  std::error_code error;
  const auto size = std::filesystem::file_size(file, error);
  const size_t bytes_each = expected * sizeof(uint32_t);
  if (error || size != sizeof(Header) + 2 * bytes_each) return false;
  const std::string bytes = readFile(file);
  if (bytes.size() != size) return false;
  Header header;
  std::memcpy(&header, bytes.data(), sizeof header);
  if (std::memcmp(header.magic, kMagic, sizeof kMagic) != 0 || header.content != content ||
      header.count != expected)
    return false;
  LightMap loaded;
  loaded.samples.resize(expected);
  loaded.bounced.resize(expected);
  std::memcpy(loaded.samples.data(), bytes.data() + sizeof header, bytes_each);
  std::memcpy(loaded.bounced.data(), bytes.data() + sizeof header + bytes_each, bytes_each);
  if (hashOf(loaded) != header.samples) return false;
  loaded.max = header.max;
  loaded.typical = header.typical;
  map = std::move(loaded);
  return true;
}

void save(const std::filesystem::path& file, const std::array<uint64_t, 2>& content,
          const LightMap& map) {
  Header header{};
  std::memcpy(header.magic, kMagic, sizeof kMagic);
  header.content = content;
  header.count = map.samples.size();
  header.samples = hashOf(map);
  header.max = map.max;
  header.typical = map.typical;
  std::string bytes(reinterpret_cast<const char*>(&header), sizeof header);
  for (const std::vector<uint32_t>* part : {&map.samples, &map.bounced})
    bytes.append(reinterpret_cast<const char*>(part->data()), part->size() * sizeof(uint32_t));
  createFolder(file.parent_path());
  writeFileAtomically(file, bytes);
}

}  // namespace

void loadOrBakeLight(RenderScene& scene, const LightBakerOptions& options, WorkerPool& pool,
                     const std::function<void()>& before_baking) {
  const std::array<uint64_t, 2> content = contentHash(scene, options);
  const std::filesystem::path file = cacheFolder() / "light" / (hex(content) + ".bin");
  const size_t expected =
      layOutLight(scene, {options.spacing_m, options.spacing_growth, options.max_samples});
  try {
    if (load(file, content, expected, scene.light)) return;
  } catch (const Error&) {  // not readable: as good as not there
  }
  if (before_baking) before_baking();
  bakeLight(scene, options, pool);
  try {
    save(file, content, scene.light);
  } catch (const Error&) {  // the next run bakes again
  }
}

}  // namespace diorama
