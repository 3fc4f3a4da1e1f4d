// Channels that only some sequences have: optical flow and normals.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <set>

#include "sim/image_file.h"
#include "sim/sequence_check_state.h"
#include "sim/sequence_names.h"
#include "sim/truth_files.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr double kFlow_px = 0.05;     // files resolve 1/64 px
constexpr double kDepth_m = 0.00012;  // and depth to half of 0.2 mm
// What turns slowly may move by more than that in few of its pixels, but not by far.
constexpr double kFreeFlow_px = 5 * kFlow_px;
constexpr double kMovingRatio = 0.2;  // more pixels of an instance off: it moves by itself
constexpr double kNormal_rad = 20 * std::numbers::pi / 180;  // 3 x 3 pixels know it no better
constexpr double kUnit = 0.02;                               // of 8 bits
// A facet that is smaller than the pixels tilts one of them, or a line; wrong normals tilt areas.
constexpr int kArea = 6;  // of 3 x 3 pixels

struct Mismatch {
  int pixels = 0, off = 0;
  Pixel first;
  void add(int x, int y) {
    if (off++ == 0) first = {x, y};
  }
};

std::string places(const Mismatch& m) {
  return atPixel(m.first.x, m.first.y) + " and at " + std::to_string(m.off - 1) + " more";
}

// `AAAAAA_BBBBBB.png`
std::optional<std::pair<int, int>> flowNumbers(const fs::path& file) {
  const std::string name = file.stem().string();
  if (file.extension() != ".png" || name.size() != 13 || name[6] != '_') return std::nullopt;
  const auto from = parseInteger(name.substr(0, 6)), to = parseInteger(name.substr(7));
  if (!from || !to) return std::nullopt;
  return std::pair(static_cast<int>(*from), static_cast<int>(*to));
}

// Of the pixels marked, those in the midst of others.
Mismatch areasOf(const Image<uint8_t>& marked) {
  Mismatch areas;
  for (int y = 1; y + 1 < marked.height; ++y)
    for (int x = 1; x + 1 < marked.width; ++x) {
      int count = 0;
      for (int k = 0; k < 9; ++k) count += marked(x + k % 3 - 1, y + k / 3 - 1);
      if (marked(x, y) && count >= kArea) areas.add(x, y);
    }
  return areas;
}

}  // namespace

void SequenceCheck::State::listFlow() {
  for (int k = 0; k < reader->frameCount(); ++k) index_of_number[reader->frameNumber(k)] = k;
  std::error_code error;
  std::set<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder / "flow", error))
    files.insert(entry.path());
  for (const fs::path& path : files) {
    const auto numbers = flowNumbers(path);
    if (!numbers) continue;
    const std::string file = "flow/" + path.filename().string();
    const auto from = index_of_number.find(numbers->first),
               to = index_of_number.find(numbers->second);
    if (from == index_of_number.end() || to == index_of_number.end())
      opening.add(Check::kFlow, file, "is between frames that are not there");
    else
      flow.emplace(from->second, std::pair(to->second, file));
  }
}

void SequenceCheck::State::checkFlow(int k, CheckResult& result) const {
  const auto [first, last] = flow.equal_range(k);
  for (auto it = first; it != last; ++it) {
    const auto& [to, file] = it->second;
    guarded(Check::kFlow, result,
            [&, &name = file, other = to] { checkFlowFile(name, k, other, result); });
  }
}

// Whether it can move in a way that no file tells: untracked, or between the rows of the shutter.
bool SequenceCheck::State::mayMove(int id, const LoadedFrame& frame) const {
  if (id == 0) return false;
  for (size_t n = 0; n < reader->objects().size(); ++n)
    if (idOf(n) == id) return !frame.view.row_poses.empty() && moves(n);
  return true;
}

// How a tracked object has moved in the world, when both poses are known; all else rests.
std::optional<SE3> SequenceCheck::State::motionOf(uint16_t id, const GroundTruth& from,
                                                  const GroundTruth& to) const {
  for (size_t n = 0; n < reader->objects().size(); ++n) {
    if (idOf(n) != id) continue;
    for (const ObjectTruth& a : from.objects)
      for (const ObjectTruth& b : to.objects)
        if (a.name == reader->objects()[n].name && b.name == a.name)
          return b.T_world_object * a.T_world_object.inverse();
    return std::nullopt;
  }
  return SE3{};
}

// How far a pixel's flow is from what depth and poses make of it, beyond what the depth's unit may
// make, px.
double SequenceCheck::State::flowError(const Vector2d& found_px, const LoadedFrame& frame,
                                       Pixel pixel, const LoadedFrame& other,
                                       const SE3& motion) const {
  const double z = static_cast<double>(frame.view.depth_m(pixel.x, pixel.y));
  const auto expected = depth->carry(frame.view, pixel, z, other.view, motion);
  if (!expected)  // at the very border the point may lie half outside the image
    return reader->camera().contains(found_px, 1) ? std::numeric_limits<double>::infinity() : 0;
  const double off = (*expected - found_px).cwiseAbs().maxCoeff();
  if (off < kFlow_px) return off;
  const auto farther = depth->carry(frame.view, pixel, z + kDepth_m, other.view, motion);
  return farther ? off - (*farther - *expected).cwiseAbs().maxCoeff() : off;
}

// Which is another check's finding.
bool SequenceCheck::State::objectsAreOff(int k) const {
  CheckResult result;
  checkObjects(k, *frame(k), result);
  return !result.findings.empty();
}

void SequenceCheck::State::checkFlowFile(const std::string& file, int k, int to,
                                         CheckResult& result) const {
  const auto from_frame = this->frame(k), to_frame = this->frame(to);
  const LoadedFrame &frame = *from_frame, &other = *to_frame;
  const int width = reader->camera().width(), height = reader->camera().height();
  const Image<Rgb16> image = readWideColor(folder / file, width, height);
  if (!frame.has_ids || other.view.depth_m.empty()) return;  // nothing tells what moves, or whither
  std::vector<std::optional<SE3>> motions;
  for (int id = 0; id <= last_id; ++id)
    motions.push_back(motionOf(static_cast<uint16_t>(id), frame.truth, other.truth));
  std::vector<Mismatch> off(motions.size()), far(motions.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Rgb16& pixel = image(x, y);
      const uint16_t id = frame.view.ids(x, y);
      if (pixel.b == 0 || id > last_id || !motions[id] || !(frame.view.depth_m(x, y) > 0)) continue;
      const Vector2d found(x + double{pixel.r - kFlowZero} / kFlowScale,
                           y + double{pixel.g - kFlowZero} / kFlowScale);
      const double error = flowError(found, frame, {x, y}, other, *motions[id]);
      ++off[id].pixels;
      if (error > kFlow_px) off[id].add(x, y);
      if (error > kFreeFlow_px) far[id].add(x, y);
    }
  for (int id = 0; id <= last_id; ++id) {
    const auto i = static_cast<size_t>(id);
    result.count(Check::kFlow, off[i].pixels);
    const bool as_a_whole = off[i].off > kMovingRatio * off[i].pixels, free = mayMove(id, frame);
    const Mismatch& wrong = free ? far[i] : off[i];
    if (wrong.off > 0 && !(as_a_whole && (free || objectsAreOff(k) || objectsAreOff(to))))
      result.add(Check::kFlow, file, "is not what depth and poses make of it " + places(wrong));
  }
}

void SequenceCheck::State::checkNormals(int k, const LoadedFrame& frame,
                                        CheckResult& result) const {
  const std::string file = frameFile("normal", reader->frameNumber(k));
  if (!fs::exists(folder / file)) return;
  guarded(Check::kNormals, result, [&] {
    const int width = reader->camera().width(), height = reader->camera().height();
    const AnyImage read = readImage(folder / file, width, height);
    const auto* image = std::get_if<Image<Rgb8>>(&read);
    if (!image) throw InputError(folder / file, "is no colour image");
    Mismatch wrong;  // no unit vector towards the camera
    Image<uint8_t> tilted(width, height);
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Rgb8 pixel = (*image)(x, y);
        if (pixel == Rgb8{}) continue;
        const Vector3d n = Vector3d(pixel.r, pixel.g, pixel.b) * (2 / 255.0) - Vector3d::Ones();
        ++wrong.pixels;
        if (std::abs(n.norm() - 1) > kUnit || n.dot(depth->ray(x, y).normalized()) > kUnit)
          wrong.add(x, y);
        const auto expected = depth->normal(frame.view, {x, y});
        tilted(x, y) = expected && n.normalized().dot(*expected) < std::cos(kNormal_rad);
      }
    result.count(Check::kNormals, wrong.pixels);
    if (wrong.off > 0)
      result.add(Check::kNormals, file, "is no unit vector towards the camera " + places(wrong));
    if (const Mismatch areas = areasOf(tilted); areas.off > 0)
      result.add(Check::kNormals, file, "is not along the depth's planes " + places(areas));
  });
}

}  // namespace diorama
