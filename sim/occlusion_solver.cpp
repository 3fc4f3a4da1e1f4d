#include "sim/occlusion_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "core/text.h"
#include "sim/frustum.h"

namespace diorama {
namespace {

// Ways are solved for within this; what is left of the tolerance is for the pixels that were not
// looked at.
constexpr double kAim = 0.6 * kOcclusionTolerance;
constexpr double kDistances_m[] = {0.45, 0.36, 0.29, 0.23, 0.18, 0.14};
constexpr double kMaxSlide_m = 2;
constexpr double kClearance_m = 0.02;
constexpr size_t kPackets = 600;  // looked at in a search, of up to some thousands

// The slides of one frame that are allowed.
struct Bounds {
  double low = 0, high = 0;
};

class Solver {
 public:
  Solver(const OcclusionRequest& request, const OccluderKind& kind, const Mesh& occluder,
         const Scene& scene, const ObjectViewer& viewer, WorkerPool& pool)
      : request_(request),
        kind_(kind),
        occluder_(occluder),
        scene_(scene),
        viewer_(viewer),
        pool_(pool),
        frustum_(viewer.camera()) {
    traceable_.add(occluder, SE3{});
    traceable_.build();
  }

  OcclusionSolution solve() {
    lookAtFrames();
    if (!problem_.empty()) return {{}, problem_};
    std::vector<double> distances(std::begin(kDistances_m), std::end(kDistances_m));
    if (request_.distance_m) distances = {*request_.distance_m};
    for (const double distance_m : distances)
      for (size_t side = 0; side < kind_.sides_rad.size(); ++side) {
        if (request_.side && *request_.side != side) continue;
        lane_ = {distance_m, kind_.sides_rad[side]};
        if (tryLane()) return {{lane_, first_, slide_m_}, ""};
      }
    return {{}, problem_};
  }

 private:
  struct Frame {
    int index = 0;
    bool active = false;   // the request holds
    double requested = 1;  // visible fraction
    bool far_side = false;
    ObjectView view;
    Vector3d object = Vector3d::Zero();  // its middle
  };

  double time_s(const Frame& frame) const { return scene_.time_s(frame.index); }
  SE3 poseAt(const Frame& frame, double slide_m) const {
    return occluderPose(kind_, lane_, frame.view.T_world_camera.translation, frame.object, slide_m);
  }
  double fractionAt(const Frame& frame, double slide_m, size_t step) const {
    return openFraction(frame.view, traceable_, poseAt(frame, slide_m), step);
  }
  bool isOut(const Frame& frame, double slide_m) const {
    return frustum_.misses(frame.view.T_world_camera, cornersOf(occluder_, poseAt(frame, slide_m)));
  }

  void lookAtFrames();
  void chooseSides();
  bool tryLane();
  std::optional<Bounds> boundsOf(const Frame& frame, double out_m, size_t step) const;
  bool findBounds(double out_m, const std::vector<size_t>& which, bool all_pixels);
  std::optional<double> outside(const Frame& frame) const;
  void relax();
  bool isClear(const std::vector<size_t>& which);
  std::vector<size_t> missed();
  bool fail(const Frame& frame, const std::string& what) {
    problem_ = "at " + formatFixed(time_s(frame), 2) + " s " + what;
    return false;
  }

  const OcclusionRequest& request_;
  const OccluderKind& kind_;
  const Mesh& occluder_;
  const Scene& scene_;
  const ObjectViewer& viewer_;
  WorkerPool& pool_;
  Frustum frustum_;
  TraceableMesh traceable_;
  std::vector<Frame> frames_;  // with those of coming and going
  int first_ = 0;
  bool comes_ = false, goes_ = false;  // the sequence shows it come and go
  OccluderLane lane_;
  std::vector<Bounds> bounds_;
  std::vector<double> slide_m_;
  std::string problem_;
};

void Solver::lookAtFrames() {
  const double start_s = request_.visible_fraction.front().time_s,
               end_s = request_.visible_fraction.back().time_s;
  constexpr double kSlack_s = 1e-6;
  for (int k = 0; k < scene_.frameCount(); ++k) {
    const double t = scene_.time_s(k);
    if (t < start_s - kApproach_s || t > end_s + kApproach_s) continue;
    Frame frame;
    frame.index = k;
    frame.active = t >= start_s - kSlack_s && t <= end_s + kSlack_s;
    frame.requested = requestedFraction(request_, t);
    frames_.push_back(std::move(frame));
  }
  if (frames_.empty()) {
    problem_ = "no frame lies between its times";
    return;
  }
  first_ = frames_.front().index;
  comes_ = first_ > 0;
  goes_ = frames_.back().index + 1 < scene_.frameCount();
  pool_.run(static_cast<int>(frames_.size()), [&](int i) {
    Frame& frame = frames_[static_cast<size_t>(i)];
    frame.view = viewer_.look(frame.index);
    frame.object = viewer_.middle(frame.index);
  });
  for (const Frame& frame : frames_)
    if (frame.active && frame.view.fraction() < frame.requested - kAim) {
      fail(frame, "only " + formatFixed(frame.view.fraction(), 3) +
                      " of the object is to be seen without an occluder");
      return;
    }
  chooseSides();
}

// An occluder that passes changes sides in the middle of each time in which it hides all.
void Solver::chooseSides() {
  bool far_side = false;
  for (size_t i = 0; i < frames_.size();) {
    size_t end = i;
    while (end < frames_.size() && frames_[end].active && frames_[end].requested <= kAim) ++end;
    if (end == i) {
      frames_[i++].far_side = far_side;
      continue;
    }
    for (const size_t middle = (i + end) / 2; i < end; ++i)
      frames_[i].far_side = far_side ^ (kind_.passes && i >= middle);
    far_side ^= kind_.passes;
  }
}

// The least slide from which on the occluder is out of the view.
std::optional<double> Solver::outside(const Frame& frame) const {
  constexpr double kStep_m = 0.02;
  const double sign = frame.far_side ? -1 : 1;
  double out_m = kMaxSlide_m;
  if (!isOut(frame, sign * out_m)) return std::nullopt;
  while (out_m > kStep_m && isOut(frame, sign * (out_m - kStep_m))) out_m -= kStep_m;
  return out_m;
}

// Visible fractions grow with the slide, up to the least slide at which nothing is hidden.
std::optional<Bounds> Solver::boundsOf(const Frame& frame, double out_m, size_t step) const {
  const double sign = frame.far_side ? -1 : 1;
  const double open = frame.view.fraction();
  constexpr int kBisections = 14;
  // The slide at which a fraction is reached.
  const auto reaching = [&](double fraction) {
    double low = 0, high = out_m;
    for (int k = 0; k < kBisections; ++k) {
      const double middle = (low + high) / 2;
      (fractionAt(frame, sign * middle, step) < fraction ? low : high) = middle;
    }
    return high;
  };
  constexpr double kUntouched = 1e-3;
  if (!frame.active) return Bounds{reaching(open - kUntouched), out_m};
  const double least = fractionAt(frame, 0, step);
  if (least > frame.requested + kAim) return std::nullopt;
  Bounds bounds;
  bounds.low = frame.requested - kAim <= least ? 0 : reaching(frame.requested - kAim);
  bounds.high = frame.requested + kAim >= open ? out_m : reaching(frame.requested + kAim);
  return bounds;
}

// Of these frames, from some or all of their pixels.
bool Solver::findBounds(double out_m, const std::vector<size_t>& which, bool all_pixels) {
  std::vector<std::optional<Bounds>> found(which.size());
  pool_.run(static_cast<int>(which.size()), [&](int i) {
    const Frame& frame = frames_[which[static_cast<size_t>(i)]];
    const size_t packets = frame.view.visible.size();
    found[static_cast<size_t>(i)] =
        boundsOf(frame, out_m, all_pixels ? 1 : std::max<size_t>(1, packets / kPackets));
  });
  for (size_t i = 0; i < which.size(); ++i) {
    const Frame& frame = frames_[which[i]];
    if (!found[i]) return fail(frame, "the occluder cannot hide that much");
    Bounds b = *found[i];
    if (frame.active && b.low == 0) b.low = -b.high;  // beyond the middle it hides as much
    if (frame.far_side) b = {-b.high, -b.low};
    bounds_[which[i]] = b;
  }
  return true;
}

bool Solver::tryLane() {
  for (const Frame& frame : frames_)
    if ((frame.object - frame.view.T_world_camera.translation).norm() <
        lane_.distance_m + viewer_.radius_m() + kClearance_m)
      return fail(frame, "the camera is too near for an occluder " +
                             formatNumber(lane_.distance_m) + " m away");
  const std::optional<double> out_first = outside(frames_.front()),
                              out_last = outside(frames_.back());
  if (!out_first || !out_last)
    return fail(out_first ? frames_.back() : frames_.front(), "the occluder cannot leave the view");
  const double out_m = std::max(*out_first, *out_last);
  bounds_.assign(frames_.size(), {});
  // A few frames tell quickly that a lane is blocked.
  constexpr size_t kStride = 6;
  std::vector<size_t> all, few;
  for (size_t k = 0; k < frames_.size(); ++k) {
    all.push_back(k);
    if (frames_[k].active && k % kStride == 0) few.push_back(k);
  }
  if (!findBounds(out_m, few, false)) return false;
  slide_m_.assign(frames_.size(), out_m);
  for (size_t k : few) slide_m_[k] = (bounds_[k].low + bounds_[k].high) / 2;
  if (!isClear(few)) return false;

  if (!findBounds(out_m, all, false)) return false;
  const double sign_first = frames_.front().far_side ? -1 : 1,
               sign_last = frames_.back().far_side ? -1 : 1;
  if (comes_) bounds_.front() = {sign_first * *out_first, sign_first * *out_first};
  if (goes_) bounds_.back() = {sign_last * *out_last, sign_last * *out_last};
  relax();
  // Frames that miss when every pixel is counted are solved for once more, with every pixel.
  if (const std::vector<size_t> again = missed(); !again.empty()) {
    if (!findBounds(out_m, again, true)) return false;
    relax();
  }
  return missed().empty() && isClear(all);
}

// From the middle of what is allowed, a path that is as smooth as it may be: each slide becomes the
// mean of its neighbours, over and over, within its bounds.
void Solver::relax() {
  constexpr int kRounds = 600;
  const size_t n = bounds_.size();
  slide_m_.resize(n);
  for (size_t k = 0; k < n; ++k) slide_m_[k] = (bounds_[k].low + bounds_[k].high) / 2;
  std::vector<double> next = slide_m_;
  for (int round = 0; round < kRounds; ++round) {
    for (size_t k = 0; k < n; ++k) {
      const double before = slide_m_[k > 0 ? k - 1 : k], after = slide_m_[k + 1 < n ? k + 1 : k];
      next[k] = std::clamp((before + 2 * slide_m_[k] + after) / 4, bounds_[k].low, bounds_[k].high);
    }
    std::swap(slide_m_, next);
  }
}

// Frames that miss their request when every pixel is counted.
std::vector<size_t> Solver::missed() {
  std::vector<double> fraction(frames_.size());
  pool_.run(static_cast<int>(frames_.size()), [&](int i) {
    const auto k = static_cast<size_t>(i);
    if (frames_[k].active) fraction[k] = fractionAt(frames_[k], slide_m_[k], 1);
  });
  std::vector<size_t> frames;
  for (size_t k = 0; k < frames_.size(); ++k) {
    if (!frames_[k].active) continue;
    if (std::abs(fraction[k] - frames_[k].requested) <= 0.9 * kOcclusionTolerance) continue;
    frames.push_back(k);
    fail(frames_[k], "the visible fraction would be " + formatFixed(fraction[k], 3) +
                         " instead of " + formatFixed(frames_[k].requested, 3));
  }
  return frames;
}

// While the occluder is in the view the edges and diagonals of its box meet nothing, and the camera
// is not in it.
bool Solver::isClear(const std::vector<size_t>& which) {
  std::vector<uint8_t> hit(which.size(), 0);
  pool_.run(static_cast<int>(which.size()), [&](int i) {
    const size_t k = which[static_cast<size_t>(i)];
    if (isOut(frames_[k], slide_m_[k])) return;
    const std::array<Vector3d, 8> corners = cornersOf(occluder_, poseAt(frames_[k], slide_m_[k]));
    for (size_t a = 0; a < 8; ++a)
      for (size_t b = a + 1; b < 8; ++b) {
        const size_t differ = a ^ b;
        const bool edge = (differ & (differ - 1)) == 0, diagonal = differ == 7;
        const bool checked = edge || diagonal;
        if (checked && viewer_.meetsScene(frames_[k].index, corners[a], corners[b]))
          hit[static_cast<size_t>(i)] = 1;
      }
  });
  const auto first = std::find(hit.begin(), hit.end(), 1);
  if (first == hit.end()) return true;
  return fail(frames_[which[static_cast<size_t>(first - hit.begin())]],
              "the occluder would touch something");
}

}  // namespace

OcclusionSolution solveOcclusion(const OcclusionRequest& request, const OccluderKind& kind,
                                 const Mesh& occluder, const Scene& scene,
                                 const ObjectViewer& viewer, WorkerPool& pool) {
  return Solver(request, kind, occluder, scene, viewer, pool).solve();
}

}  // namespace diorama
