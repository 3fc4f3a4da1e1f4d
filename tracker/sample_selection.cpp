#include "tracker/sample_selection.h"

#include <algorithm>

namespace diorama {
SampleSelection::SampleSelection(const EdgeModel& model, const Mesh& mesh, const Camera& camera,
                                 const RayQuery& rays, int object, const EdgeSearch& search,
                                 const TrackerOptions& options)
    : model_(model),
      camera_(camera),
      search_(search),
      options_(options),
      surface_(mesh, model.centre_object, camera, rays, object, options) {}

void SampleSelection::setImage(const EdgePicture& picture, Covers covers) {
  picture_ = picture;
  part_ = {};
  covers_ = covers;
  T_changed_.reset();
  changed_ = {};
  selected_.reset();
}

void SampleSelection::setPart(const ImagePart& part) {
  part_ = part;
  selected_.reset();
}

// The map is coarse: it holds for poses nearby.
const CoverMap& SampleSelection::changedAt(const SE3& T) {
  constexpr double kNearby = 3;  // px
  if (covers_ != Covers::kIgnored) lookFrom(T, kNearby);
  return changed_;
}

// The surface, from a pose so near at most.
const std::vector<SurfaceLook::Sight>& SampleSelection::lookFrom(const SE3& T, double distance_px) {
  if (!T_changed_ || pixelMotion(model_, camera_, T, *T_changed_) > distance_px) {
    sights_ = surface_.look(*picture_, T);
    changed_ = surface_.compare(sights_);
    T_changed_ = T;
  }
  return sights_;
}

const CoverMap& SampleSelection::coverAt(const SE3& T) {
  static const CoverMap nothing;
  return covers_ == Covers::kLeftOut ? changedAt(T) : nothing;
}

const SampleSelection::Samples& SampleSelection::at(const SE3& T, int max_samples) {
  if (!selected_ || !(selected_->T_camera_model == T) || selected_->max_samples != max_samples)
    selected_ = {T, max_samples, select(T, max_samples)};
  return selected_->samples;
}

SampleSelection::Samples SampleSelection::select(const SE3& T, int max_samples) {
  std::vector<int> visible, familiar;
  const CoverMap& changed = changedAt(T);
  const Matrix3d R = T.rotationMatrix();
  for (const int sample : search_.visibleSamples(T, max_samples)) {
    const auto u =
        camera_.project(R * model_.samples[static_cast<size_t>(sample)].p + T.translation);
    if (u && !part_.contains(*u)) continue;
    visible.push_back(sample);
    if (!u || !changed.isCovered(*u)) familiar.push_back(sample);
  }
  const double share = std::max(1.0, static_cast<double>(familiar.size())) /
                       std::max(1.0, static_cast<double>(visible.size()));
  if (covers_ != Covers::kLeftOut) return {std::move(visible), share};
  if (changed.any()) removeUnfamiliar(T, familiar);
  return {std::move(familiar), share};
}

std::vector<SampleSides> SampleSelection::sidesOf(const SE3& T, const std::vector<int>& samples,
                                                  bool outline_only) const {
  constexpr int kNear = 3;  // px: so near an outline the object is to be seen on one side alone
  return search_.sidesOf(T, samples, kNear, OutlineLikelihood::kReach, outline_only);
}

// The map is coarse, and knows only sides that were seen before. Beside what it has found nothing
// is believed whose surroundings have colours that are new.
void SampleSelection::removeUnfamiliar(const SE3& T, std::vector<int>& samples) const {
  if (!colors_.known()) return;
  auto next = samples.begin();
  for (const SampleSides& s : sidesOf(T, samples, false)) {
    next = std::find(next, samples.end(), s.sample);
    if (!colors_.isFamiliar(*picture_, s)) next = samples.erase(next);
  }
}

std::vector<OutlineLikelihood> SampleSelection::outlineAt(const SE3& T,
                                                          const std::vector<int>& samples) const {
  std::vector<OutlineLikelihood> outline;
  if (!colors_.known()) return outline;
  for (const SampleSides& s : sidesOf(T, samples, true))
    outline.push_back(colors_.compare(*picture_, s));
  return outline;
}

void SampleSelection::learn(const SE3& T, const std::vector<int>& samples) {
  selected_.reset();
  constexpr double kSame = 0.5;  // px
  const CoverMap& cover = coverAt(T);
  surface_.learn(lookFrom(T, kSame), cover);
  if (!(options_.region_correlation > 0)) return;
  // What covers the object must not be taken for it.
  const float rate = static_cast<float>(options_.region_rate);
  colors_.learn(*picture_, sidesOf(T, samples, true), cover.any() ? 0 : rate, rate);
}

}  // namespace diorama
