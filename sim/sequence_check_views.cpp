// Depth and poses: frames against their neighbours.
#include <algorithm>

#include "sim/sequence_check_state.h"

namespace diorama {
namespace {

// A camera that is 5 mm or half a degree off sets a tenth of the samples apart, a good one none.
constexpr double kPoseOffRatio = 0.03;
constexpr int kPoseSamples = 100;
constexpr int kInstanceSamples = 20;
constexpr double kMovingRatio = 0.2;  // more of its samples apart: the instance moves by itself
constexpr int kMovingSamples = 8;
constexpr double kPixelOff_m = 0.01;
constexpr double kSpread_m = 0.002;  // all frames have a wrong pixel wrong by the same
constexpr int kNearlyAllLines = 10;
constexpr int kContinuedLines = 6;  // of 12: a pixel that is put right continues its neighbours
constexpr int kStructure_px = 16;   // within this distance thin things show themselves again
constexpr size_t kShown = 3;        // findings of one kind in a frame

}  // namespace

// The rows of a rolling shutter follow each other smoothly, and the frame's pose is in their
// middle.
void SequenceCheck::State::checkRows(int k, const LoadedFrame& frame, CheckResult& result) const {
  // Rows are some 30 us apart: no hand accelerates by more than a nanometre in that time.
  constexpr double kSmooth = 1e-5;  // m or rad
  const std::vector<SE3>& rows = frame.view.row_poses;
  if (rows.size() < 3) return;
  const size_t middle = (rows.size() - 1) / 2;
  const SE3 step = rows[middle].inverse() * rows[rows.size() / 2];
  const SE3 expected = rows[middle] * exp(0.5 * log(step));
  if (log(expected.inverse() * frame.view.T_world_camera).norm() > kSmooth)
    result.add(Check::kPoses, "groundtruth.txt",
               "at " + formatSeconds(reader->timestampNs(k)) +
                   " the pose is not that of the middle row in row_poses.csv");
  for (size_t y = 1; y + 1 < rows.size(); ++y) {
    const Vector6d bend =
        log(rows[y - 1].inverse() * rows[y]) - log(rows[y].inverse() * rows[y + 1]);
    if (bend.norm() < kSmooth) continue;
    result.add(Check::kPoses, "row_poses.csv",
               "jumps in frame " + std::to_string(reader->frameNumber(k)) + " at row " +
                   std::to_string(y));
    return;
  }
}

namespace {

// Whether what rests lies apart. The background (id 0) never moves; of the instances, which may
// move by themselves, most must be off.
bool liesApart(const std::vector<Agreement>& agreements) {
  if (agreements[0].samples >= kPoseSamples && agreements[0].offRatio() > kPoseOffRatio)
    return true;
  int instances = 0, off = 0;
  Agreement all;
  for (size_t id = 1; id < agreements.size(); ++id) {
    const Agreement& a = agreements[id];
    all.samples += a.samples;
    all.off += a.off;
    if (a.samples < kInstanceSamples) continue;
    ++instances;
    off += a.offRatio() > kPoseOffRatio;
  }
  if (agreements[0].samples < kPoseSamples && all.samples >= kPoseSamples)
    return 2 * all.off > all.samples || (2 * off >= instances && all.offRatio() > kPoseOffRatio);
  return instances >= 3 && 3 * off > 2 * instances;
}

int64_t samplesOf(const std::vector<Agreement>& agreements) {
  int64_t samples = 0;
  for (const Agreement& a : agreements) samples += a.samples;
  return samples;
}

}  // namespace

// Whether the camera's pose is wrong: what rests lies apart in each of the nearest frames.
bool SequenceCheck::State::checkPose(int k, const LoadedFrame& frame, CheckResult& result) const {
  const int count = reader->frameCount();
  std::vector<int> others = {k - 1, k + 1};
  if (k == 0) others = {1, 2};  // that one alone could be the wrong one
  if (k == count - 1) others = {k - 1, k - 2};
  int compared = 0, apart = 0;
  for (int other : others) {
    if (other < 0 || other >= count) continue;
    const auto neighbour = this->frame(other);
    if (neighbour->view.depth_m.empty()) continue;
    std::vector<Agreement> agreements = depth->compare(frame.view, neighbour->view, last_id + 1);
    for (size_t n = 0; n < reader->objects().size(); ++n)  // these have their own poses
      if (const auto id = idOf(n)) agreements[*id] = {};
    const int64_t samples = samplesOf(agreements);
    if (samples < kPoseSamples) continue;
    result.count(Check::kPoses, samples);
    ++compared;
    apart += liesApart(agreements);
  }
  if (compared == 0 || apart < compared) return false;
  result.add(Check::kPoses, "groundtruth.txt",
             "at " + formatSeconds(reader->timestampNs(k)) + " (frame " +
                 std::to_string(reader->frameNumber(k)) +
                 ") the pose does not carry the depth onto the neighbouring frames");
  return true;
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
    if (depth->mayShow(frame.view, pixel, other)) return std::nullopt;
    const auto off = depth->difference(frame.view, pixel, other);
    if (!off) continue;
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
  // A step that is smaller than the pixel may be a thing that is, too.
  const bool small = std::abs(off) < depth->footprint(frame.view, pixel);
  if (depth->continuedLines(frame.view, pixel, off) < (small ? kNearlyAllLines : kContinuedLines) ||
      showsItselfAgain(frame, pixel, off, others))
    return std::nullopt;
  return off;
}

// Something thinner than a pixel is hit now and then, here or in other frames: there, too, it
// stands off what is beside it by about as much. What is seen through a gap nearby may just have
// its depth.
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
             std::abs(z - place->p.z()) < tolerance && depth->standsOff(other.view, p, off_m);
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

}  // namespace diorama
