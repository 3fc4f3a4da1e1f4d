#include "sim/sequence_check.h"

#include <algorithm>
#include <future>
#include <map>
#include <mutex>
#include <optional>

#include "core/files.h"
#include "core/text.h"
#include "sim/image_file.h"
#include "sim/mesh_import.h"
#include "sim/sequence_check_depth.h"
#include "sim/sequence_check_files.h"
#include "sim/sequence_check_objects.h"
#include "sim/sequence_names.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr int kCompany = 8;  // frames before and after a frame that bear witness
// A camera that is 5 mm or half a degree off sets a tenth of the samples apart, a good one none.
constexpr double kPoseOffRatio = 0.03;
constexpr int kPoseSamples = 100;
constexpr double kMovingRatio = 0.2;  // more of its samples apart: the instance moves by itself
constexpr int kMovingSamples = 8;
constexpr double kPixelOff_m = 0.01;
constexpr double kSpread_m = 0.002;  // all frames have a wrong pixel wrong by the same
constexpr int kContinuedLines = 6;   // of 12: a pixel that is put right continues its neighbours
constexpr int kStructure_px = 16;    // within this distance thin things show themselves again
constexpr size_t kShown = 3;         // findings of one kind in a frame

fs::path relativeName(const fs::path& file, const fs::path& folder) {
  return file.lexically_normal().lexically_relative(folder.lexically_normal());
}

struct LoadedFrame {
  GroundTruth truth;  // its depth and ids are in the view
  DepthView view;
  bool has_ids = false;  // else they are all 0
  std::vector<Pixel> lonely;
};

std::string atPixel(int x, int y) {
  return "at pixel (" + std::to_string(x) + ", " + std::to_string(y) + ")";
}

std::string millimetres(double m) { return formatFixed(1e3 * m, 1) + " mm"; }

}  // namespace

void CheckResult::append(const CheckResult& other) {
  findings.insert(findings.end(), other.findings.begin(), other.findings.end());
  for (size_t i = 0; i < examined.size(); ++i) examined[i] += other.examined[i];
}

struct SequenceCheck::State {
  explicit State(fs::path f) : folder(std::move(f)) {}

  void open();
  std::shared_ptr<const LoadedFrame> frame(int k) const;
  std::shared_ptr<const LoadedFrame> load(int k) const;
  std::vector<std::shared_ptr<const LoadedFrame>> company(int k) const;
  fs::path depthFile(int k) const;
  std::optional<uint16_t> idOf(size_t object) const;
  template <class F>
  void guarded(Check check, CheckResult& result, const F& f) const;

  void checkSumsOf(int part, CheckResult& result) const;
  void checkImages(int k, CheckResult& result) const;
  void checkMasks(int k, const LoadedFrame& frame, CheckResult& result) const;
  Image<uint8_t> visibleMask(int k, size_t object) const;
  bool checkPose(int k, const LoadedFrame& frame, CheckResult& result) const;
  void checkObjects(int k, const LoadedFrame& frame, CheckResult& result) const;
  void nameDifferences(int k, size_t object, const ObjectTruth& truth,
                       const ObjectDifferences& differences, CheckResult& result) const;
  void checkDepth(int k, const LoadedFrame& frame, CheckResult& result) const;
  std::optional<double> misplaced(const LoadedFrame& frame, Pixel pixel,
                                  const std::vector<std::shared_ptr<const LoadedFrame>>& others,
                                  std::map<std::pair<size_t, uint16_t>, bool>& resting) const;
  bool showsItselfAgain(const LoadedFrame& frame, Pixel pixel, double off_m,
                        const std::vector<std::shared_ptr<const LoadedFrame>>& others) const;

  fs::path folder;
  CheckResult opening;  // what was wrong with the text files
  std::optional<FileSums> manifest;
  std::optional<SequenceReader> reader;
  std::map<std::string, uint16_t> instances;
  std::optional<DepthComparison> depth;
  std::optional<ObjectComparison> objects;
  int last_id = 0;

  mutable std::mutex mutex;
  mutable std::map<int, std::shared_future<std::shared_ptr<const LoadedFrame>>> loaded;
};

// What is wrong with a file is a finding about it.
template <class F>
void SequenceCheck::State::guarded(Check check, CheckResult& result, const F& f) const {
  try {
    f();
  } catch (const Error& error) {
    std::string what = error.what(), file = "sequence.yaml";
    const std::string home = (folder / "").string();
    if (what.starts_with(home)) what.erase(0, home.size());
    const size_t colon = what.find(':');
    if (colon != std::string::npos) {
      file = what.substr(0, colon);
      what = std::string(trim(std::string_view(what).substr(colon + 1)));
    }
    result.add(check, file, what);
  }
}

void SequenceCheck::State::open() {
  if (fs::exists(folder / "manifest.csv"))
    guarded(Check::kFiles, opening, [&] { manifest = readManifest(folder / "manifest.csv"); });
  guarded(Check::kFiles, opening, [&] {
    reader.emplace(folder);
    std::vector<Mesh> meshes;
    for (const SequenceObject& object : reader->objects())
      meshes.push_back(importMesh(object.model, {object.scale, object.y_up}));
    objects.emplace(reader->camera(), meshes);
    depth.emplace(reader->camera());
  });
  if (!depth) reader.reset();
  if (fs::exists(folder / "instances.csv"))
    guarded(Check::kMasks, opening, [&] { instances = readInstances(folder / "instances.csv"); });
  for (const auto& [name, id] : instances) last_id = std::max<int>(last_id, id);
}

std::shared_ptr<const LoadedFrame> SequenceCheck::State::load(int k) const {
  auto frame = std::make_shared<LoadedFrame>();
  std::optional<GroundTruth> truth = reader->readTruth(k);
  if (!truth) return frame;
  frame->view.T_world_camera = truth->T_world_camera;
  frame->view.depth_m = std::move(truth->depth_m);
  frame->view.ids = std::move(truth->instance_id);
  frame->has_ids = !frame->view.ids.empty() && !instances.empty();
  if (frame->view.ids.empty())
    frame->view.ids = Image<uint16_t>(reader->camera().width(), reader->camera().height());
  frame->truth = std::move(*truth);
  if (!frame->view.depth_m.empty()) frame->lonely = depth->lonelyPixels(frame->view);
  return frame;
}

// Frames are kept while others may ask for them. One that cannot be read is an empty one to others.
std::shared_ptr<const LoadedFrame> SequenceCheck::State::frame(int k) const {
  constexpr size_t kKept = 2 * kCompany + 16;
  std::promise<std::shared_ptr<const LoadedFrame>> promise;
  std::shared_future<std::shared_ptr<const LoadedFrame>> future;
  bool mine = false;
  {
    const std::lock_guard lock(mutex);
    const auto known = loaded.find(k);
    if (known != loaded.end()) {
      future = known->second;
    } else {
      mine = true;
      future = loaded.emplace(k, promise.get_future().share()).first->second;
      while (loaded.size() > kKept && loaded.begin()->first != k) loaded.erase(loaded.begin());
    }
  }
  if (mine) {
    try {
      promise.set_value(load(k));
    } catch (const Error&) {
      promise.set_value(std::make_shared<LoadedFrame>());
    }
  }
  return future.get();
}

// The nearest first.
std::vector<std::shared_ptr<const LoadedFrame>> SequenceCheck::State::company(int k) const {
  std::vector<std::shared_ptr<const LoadedFrame>> others;
  for (int d = 1; d <= kCompany; ++d)
    for (int other : {k - d, k + d})
      if (other >= 0 && other < reader->frameCount()) {
        others.push_back(frame(other));
        if (others.back()->view.depth_m.empty()) others.pop_back();
      }
  return others;
}

fs::path SequenceCheck::State::depthFile(int k) const {
  for (const ImageEntry& entry : reader->depthImages())
    if (entry.timestamp_ns == reader->timestampNs(k)) return relativeName(entry.file, folder);
  return "depth.txt";
}

std::optional<uint16_t> SequenceCheck::State::idOf(size_t object) const {
  const auto found = instances.find(reader->objects()[object].name);
  return found == instances.end() ? std::nullopt : std::optional(found->second);
}

void SequenceCheck::State::checkSumsOf(int part, CheckResult& result) const {
  if (!manifest) return;
  const size_t parts = reader ? static_cast<size_t>(reader->frameCount()) : 1;
  const auto bound = [&](size_t i) { return manifest->size() * i / parts; };
  const size_t i = static_cast<size_t>(part);
  checkSums(folder, *manifest, bound(i), bound(i + 1), result);
}

// The picture of a frame and the truth that lies beside it can be read.
void SequenceCheck::State::checkImages(int k, CheckResult& result) const {
  guarded(Check::kImages, result, [&] {
    readImage(reader->images()[static_cast<size_t>(k)].file, reader->camera().width(),
              reader->camera().height());
  });
  result.count(Check::kImages, 1);
  for (const char* channel : {"depth", "id"}) {
    const std::string file = frameFile(channel, reader->frameNumber(k));
    if (fs::is_directory(folder / channel) && !fs::exists(folder / file))
      result.add(Check::kImages, file, "is not there");
  }
}

Image<uint8_t> SequenceCheck::State::visibleMask(int k, size_t object) const {
  const fs::path file = folder / maskFile("mask_visib", reader->frameNumber(k), object);
  if (!fs::exists(file)) return {};
  const AnyImage image = readImage(file, reader->camera().width(), reader->camera().height());
  if (!std::holds_alternative<Image<uint8_t>>(image))
    throw InputError(file, "must be a grey image of 8 bits");
  return std::get<Image<uint8_t>>(image);
}

namespace {

int countSet(const Image<uint8_t>& mask) {
  return static_cast<int>(
      mask.pixels.size() -
      static_cast<size_t>(std::count(mask.pixels.begin(), mask.pixels.end(), uint8_t{0})));
}

void checkValues(const Image<uint8_t>& mask, const std::string& file, CheckResult& result) {
  const auto odd = std::find_if(mask.pixels.begin(), mask.pixels.end(),
                                [](uint8_t v) { return v != 0 && v != 255; });
  if (odd != mask.pixels.end())
    result.add(Check::kMasks, file, "has the value " + std::to_string(*odd) + ", not 0 or 255");
}

// The first pixel for which a condition does not hold.
template <class F>
std::optional<Pixel> firstPixel(int width, int height, const F& wrong) {
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x)
      if (wrong(x, y)) return Pixel{x, y};
  return std::nullopt;
}

}  // namespace

void SequenceCheck::State::checkMasks(int k, const LoadedFrame& frame, CheckResult& result) const {
  const int w = reader->camera().width(), h = reader->camera().height();
  if (frame.has_ids)
    if (const auto odd =
            firstPixel(w, h, [&](int x, int y) { return frame.view.ids(x, y) > last_id; }))
      result.add(Check::kMasks, frameFile("id", reader->frameNumber(k)),
                 "has an id that is not in instances.csv, " + atPixel(odd->x, odd->y));
  for (size_t n = 0; n < reader->objects().size(); ++n) {
    const std::string name = reader->objects()[n].name;
    const auto truth = std::find_if(frame.truth.objects.begin(), frame.truth.objects.end(),
                                    [&](const ObjectTruth& o) { return o.name == name; });
    if (truth == frame.truth.objects.end()) continue;
    const std::string whole_file = maskFile("mask", reader->frameNumber(k), n),
                      visible_file = maskFile("mask_visib", reader->frameNumber(k), n);
    const Image<uint8_t>& whole = truth->mask;
    const Image<uint8_t> visible = visibleMask(k, n);
    for (const auto& [folder_name, mask, file] :
         {std::tuple{"mask", &whole, &whole_file}, {"mask_visib", &visible, &visible_file}}) {
      if (mask->empty() && fs::is_directory(folder / folder_name))
        result.add(Check::kMasks, *file, "is not there");
      checkValues(*mask, *file, result);
      result.count(Check::kMasks, static_cast<int64_t>(mask->pixels.size()));
    }
    if (!visible.empty() && !whole.empty())
      if (const auto odd =
              firstPixel(w, h, [&](int x, int y) { return visible(x, y) && !whole(x, y); }))
        result.add(Check::kMasks, visible_file,
                   "shows the object outside its whole mask, " + atPixel(odd->x, odd->y));
    if (const auto id = idOf(n); id && frame.has_ids && !visible.empty())
      if (const auto odd = firstPixel(w, h, [&](int x, int y) {
            return (frame.view.ids(x, y) == *id) != (visible(x, y) != 0);
          }))
        result.add(Check::kMasks, visible_file,
                   "is not what the ids say, " + atPixel(odd->x, odd->y));
    const auto compare = [&](const Image<uint8_t>& mask, int expected, const std::string& file) {
      if (mask.empty() || expected < 0) return;
      result.count(Check::kVisibility, 1);
      if (countSet(mask) != expected)
        result.add(Check::kVisibility, file,
                   "has " + std::to_string(countSet(mask)) + " pixels, visibility.csv has " +
                       std::to_string(expected));
    };
    compare(whole, truth->px_valid, whole_file);
    compare(visible, truth->px_visible, visible_file);
  }
}

// Whether the camera's pose is wrong: what rests lies apart in each of the nearest frames.
bool SequenceCheck::State::checkPose(int k, const LoadedFrame& frame, CheckResult& result) const {
  std::vector<uint16_t> tracked;
  for (size_t n = 0; n < reader->objects().size(); ++n)
    if (const auto id = idOf(n)) tracked.push_back(*id);
  int compared = 0, apart = 0;
  double worst = 0;
  for (int other : {k - 1, k + 1}) {
    if (other < 0 || other >= reader->frameCount()) continue;
    const auto neighbour = this->frame(other);
    if (neighbour->view.depth_m.empty()) continue;
    std::vector<Agreement> all = depth->compare(frame.view, neighbour->view, last_id + 1);
    for (uint16_t id : tracked) all[id] = {};
    Agreement rest, resting;
    for (const Agreement& a : all) {
      rest.samples += a.samples;
      rest.off += a.off;
      if (a.offRatio() > kMovingRatio && &a != &all[0]) continue;
      resting.samples += a.samples;
      resting.off += a.off;
    }
    // Things that move by themselves do not count, while most of the picture rests.
    const Agreement& sum = 2 * resting.samples > rest.samples ? resting : rest;
    if (sum.samples < kPoseSamples) continue;
    result.count(Check::kPoses, sum.samples);
    ++compared;
    apart += sum.offRatio() > kPoseOffRatio;
    worst = std::max(worst, sum.offRatio());
  }
  if (compared == 0 || apart < compared) return false;
  result.add(Check::kPoses, "groundtruth.txt",
             "at " + formatSeconds(reader->timestampNs(k)) + " (frame " +
                 std::to_string(reader->frameNumber(k)) +
                 ") the pose does not carry the depth onto the neighbouring frames (" +
                 formatFixed(100 * worst, 0) + "% of the samples lie apart)");
  return true;
}

void SequenceCheck::State::checkObjects(int k, const LoadedFrame& frame,
                                        CheckResult& result) const {
  for (size_t n = 0; n < reader->objects().size(); ++n) {
    const std::string& name = reader->objects()[n].name;
    for (const ObjectTruth& truth : frame.truth.objects) {
      if (truth.name != name) continue;
      const auto id = frame.has_ids ? idOf(n) : std::nullopt;
      const ObjectImages images{id ? frame.view.depth_m : Image<float>{}, truth.mask,
                                [&](int x, int y) { return id && frame.view.ids(x, y) == *id; }};
      if (images.depth_m.empty() && images.mask.empty()) continue;
      const auto pose = [&](int) {
        return frame.view.T_world_camera.inverse() * truth.T_world_object;
      };
      const ObjectDifferences differences = objects->compare(static_cast<int>(n), pose, images);
      result.count(Check::kObjects, differences.pixels);
      nameDifferences(k, n, truth, differences, result);
    }
  }
}

// Which file is to blame: a wrong pose moves outlines, of which the masks' counts know nothing.
void SequenceCheck::State::nameDifferences(int k, size_t object, const ObjectTruth& truth,
                                           const ObjectDifferences& d, CheckResult& result) const {
  constexpr int kManyPixels = 8;
  const std::string& name = reader->objects()[object].name;
  const std::string mask_file = maskFile("mask", reader->frameNumber(k), object);
  const bool mask_is_whole = truth.mask.empty() || countSet(truth.mask) == truth.px_valid;
  if (d.mask + d.depth > kManyPixels && d.mask > 0 && mask_is_whole) {
    result.add(Check::kObjects, "objects/" + name + ".txt",
               "at " + formatSeconds(reader->timestampNs(k)) + " (frame " +
                   std::to_string(reader->frameNumber(k)) + ") the mesh at this pose does not " +
                   "give the mask and the depth (" + std::to_string(d.mask) + " and " +
                   std::to_string(d.depth) + " pixels are off)");
    return;
  }
  if (d.mask > 0)
    result.add(Check::kObjects, mask_file,
               "is not the silhouette of the mesh, " + atPixel(d.mask_x, d.mask_y) + " and " +
                   std::to_string(d.mask - 1) + " more");
  if (d.depth > 0)
    result.add(Check::kObjects, depthFile(k).generic_string(),
               "is " + millimetres(d.depth_off_m) + " off the mesh of " + name + " " +
                   atPixel(d.depth_x, d.depth_y) + " and at " + std::to_string(d.depth - 1) +
                   " more");
  if (d.hidden > 0)
    result.add(Check::kObjects, depthFile(k).generic_string(),
               name + " is hidden, yet nothing stands before it, " +
                   atPixel(d.hidden_x, d.hidden_y) + " and at " + std::to_string(d.hidden - 1) +
                   " more");
}

// How far a pixel is off, when the other frames agree on it: none of them shows anything at its
// depth, and all that show a surface there have it at the same other depth.
std::optional<double> SequenceCheck::State::misplaced(
    const LoadedFrame& frame, Pixel pixel,
    const std::vector<std::shared_ptr<const LoadedFrame>>& others,
    std::map<std::pair<size_t, uint16_t>, bool>& resting) const {
  const uint16_t id = frame.view.ids(pixel.x, pixel.y);
  double least = 0, most = 0;
  int witnesses = 0;
  for (size_t i = 0; i < others.size(); ++i) {
    const DepthView& other = others[i]->view;
    const auto off = depth->difference(frame.view, pixel, other);
    if (!off) {
      if (depth->seenNearby(frame.view, pixel, other)) return std::nullopt;
      continue;
    }
    if (std::abs(*off) < kPixelOff_m) return std::nullopt;
    if (id != 0) {
      const auto [known, is_new] = resting.try_emplace({i, id});
      if (is_new) {
        const Agreement a = depth->compareInstance(frame.view, other, id);
        known->second = a.samples >= kMovingSamples && a.offRatio() < kMovingRatio;
      }
      if (!known->second) continue;
    }
    least = witnesses ? std::min(least, *off) : *off;
    most = witnesses ? std::max(most, *off) : *off;
    ++witnesses;
  }
  const int needed = std::min(2, reader->frameCount() - 1);
  if (witnesses < needed || witnesses == 0 || most - least > kSpread_m) return std::nullopt;
  const double off = (least + most) / 2;
  if (depth->continuedLines(frame.view, pixel, off) < kContinuedLines ||
      showsItselfAgain(frame, pixel, off, others))
    return std::nullopt;
  return off;
}

// Something thinner than a pixel is hit now and then, here or in other frames.
bool SequenceCheck::State::showsItselfAgain(
    const LoadedFrame& frame, Pixel pixel, double off_m,
    const std::vector<std::shared_ptr<const LoadedFrame>>& others) const {
  constexpr double kSameThing = 0.3;  // of its distance from what is behind it
  const double tolerance = 0.002 + kSameThing * std::abs(off_m);
  const auto near = [&](const LoadedFrame& other, bool itself) {
    const auto place = depth->placeOf(frame.view, pixel, other.view);
    if (!place) return false;
    return std::any_of(other.lonely.begin(), other.lonely.end(), [&](const Pixel& p) {
      if (itself && p.x == pixel.x && p.y == pixel.y) return false;
      const double z = static_cast<double>(other.view.depth_m(p.x, p.y));
      return std::abs(p.x - place->u_px.x()) <= kStructure_px &&
             std::abs(p.y - place->u_px.y()) <= kStructure_px &&
             std::abs(z - place->depth_m) < tolerance;
    });
  };
  if (near(frame, true)) return true;
  return std::any_of(others.begin(), others.end(),
                     [&](const auto& other) { return near(*other, false); });
}

void SequenceCheck::State::checkDepth(int k, const LoadedFrame& frame, CheckResult& result) const {
  result.count(Check::kDepth, static_cast<int64_t>(frame.view.depth_m.pixels.size()));
  if (frame.lonely.empty()) return;
  const auto others = company(k);
  std::map<std::pair<size_t, uint16_t>, bool> resting;
  std::vector<uint16_t> tracked;  // compared with their meshes
  for (size_t n = 0; n < reader->objects().size(); ++n)
    if (const auto id = idOf(n)) tracked.push_back(*id);
  size_t found = 0;
  for (const Pixel& pixel : frame.lonely) {
    const uint16_t id = frame.view.ids(pixel.x, pixel.y);
    if (std::find(tracked.begin(), tracked.end(), id) != tracked.end()) continue;
    const auto off = misplaced(frame, pixel, others, resting);
    if (!off) continue;
    if (++found > kShown) break;
    result.add(Check::kDepth, depthFile(k).generic_string(),
               "is " + millimetres(*off) + " off the surface that other frames show, " +
                   atPixel(pixel.x, pixel.y));
  }
}

SequenceCheck::SequenceCheck(fs::path folder) : state_(std::make_unique<State>(std::move(folder))) {
  std::error_code error;
  if (!fs::is_regular_file(state_->folder / "sequence.yaml", error))
    throw MissingInputError(state_->folder / "sequence.yaml", "expected a sequence folder");
  state_->open();
}
SequenceCheck::~SequenceCheck() = default;

int SequenceCheck::partCount() const {
  return state_->reader ? std::max(1, state_->reader->frameCount()) : 1;
}

CheckResult SequenceCheck::checkPart(int part) const {
  CheckResult result;
  state_->checkSumsOf(part, result);
  if (!state_->reader) return result;
  const size_t problems = result.findings.size();
  state_->checkImages(part, result);
  if (result.findings.size() > problems) return result;  // the rest would only say so again
  const std::shared_ptr<const LoadedFrame> frame = state_->frame(part);
  state_->guarded(Check::kMasks, result, [&] { state_->checkMasks(part, *frame, result); });
  const bool has_depth = !frame->view.depth_m.empty();
  if (has_depth && state_->checkPose(part, *frame, result)) return result;
  state_->checkObjects(part, *frame, result);
  if (has_depth) state_->checkDepth(part, *frame, result);
  return result;
}

CheckResult SequenceCheck::checkWhole() const {
  CheckResult result = state_->opening;
  if (!state_->reader) return result;
  const SequenceReader& sequence = *state_->reader;
  checkTimes(sequence, result);
  const auto visibility = state_->folder / "visibility.csv";
  if (fs::exists(visibility))
    state_->guarded(Check::kVisibility, result,
                    [&] { checkVisibilityRows(sequence, visibility, result); });
  state_->guarded(Check::kPoses, result, [&] { checkPaths(sequence, result); });
  return result;
}

}  // namespace diorama
