// Pictures, ids, masks, and the meshes of tracked objects.
#include <algorithm>

#include "sim/image_file.h"
#include "sim/sequence_check_state.h"
#include "sim/sequence_names.h"

namespace diorama {
namespace fs = std::filesystem;

// The picture of a frame and the truth that lies beside it can be read.
void SequenceCheck::State::checkImages(int k, CheckResult& result) const {
  guarded(Check::kImages, result, [&] {
    readImage(reader->images()[static_cast<size_t>(k)].file, reader->camera().width(),
              reader->camera().height());
  });
  result.count(Check::kImages, 1);
  for (const char* channel : {"depth", "id", "normal"}) {
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

bool SequenceCheck::State::moves(size_t object) const {
  const std::vector<StampedPose>& poses = reader->trueObjectPaths()[object].poses;
  return std::any_of(poses.begin(), poses.end(), [&](const StampedPose& stamped) {
    const SE3 motion = poses.front().pose.inverse() * stamped.pose;
    return log(motion).norm() > 1e-9;
  });
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
      // A rolling shutter sees a moving object at another pose in each row, which no file has.
      if (!frame.view.row_poses.empty() && moves(n)) continue;
      const auto pose = [&](int row) {
        return frame.view.cameraOf(row).inverse() * truth.T_world_object;
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

}  // namespace diorama
