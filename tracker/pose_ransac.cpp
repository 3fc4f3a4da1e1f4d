#include "tracker/pose_ransac.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <opencv2/calib3d.hpp>

#include "tracker/pose_solver.h"

namespace diorama {
namespace {

constexpr int kP3pSize = 3, kEpnpSize = 5;
// Places whose training views are further apart do not show together on most objects.
constexpr double kSameSide = 0.5;     // cosine of 60 degrees
constexpr double kDegenerate = 0.02;  // sine: places of a sample on one line
constexpr int kDraws = 8;             // for a partner from the same side

double errorPx(const SE3& T, const Camera& camera, const PointMatch& match) {
  const auto u = camera.project(T * match.p_object);
  return u ? (*u - match.u_px).norm() : 1e9;
}

constexpr double kSigma = 1.0 / 3;  // of the inliers, in the distance within which they lie

// Reprojection errors for the Gauss-Newton solver.
class PointCue : public Cue {
 public:
  PointCue(const std::vector<PointMatch>& matches, const std::vector<int>& used,
           const Camera& camera, double sigma_px)
      : matches_(matches), used_(used), camera_(camera), sigma_px_(sigma_px) {}

  CueEquations linearise(const SE3& T) override {
    constexpr double kTukey = 4.6851;
    CueEquations equations;
    equations.sigma_px = sigma_px_;
    const Matrix3d R = T.rotationMatrix();
    for (const int i : used_) {
      const PointMatch& match = matches_[static_cast<size_t>(i)];
      const auto projection = camera_.projectWithJacobian(T * match.p_object);
      if (!projection) continue;
      const Vector2d error = projection->u_px - match.u_px;
      const Matrix26d J = pointJacobian(projection->J, R, match.p_object);
      const double weight = tukeyWeight(error.norm() / sigma_px_, kTukey) / (sigma_px_ * sigma_px_);
      for (int k = 0; k < 2; ++k) equations.add(J.row(k).transpose(), error[k], weight);
      equations.residuals += 2;
    }
    return equations;
  }

 private:
  const std::vector<PointMatch>& matches_;
  const std::vector<int>& used_;
  const Camera& camera_;
  double sigma_px_;
};

SE3 toPose(const cv::Mat& rotation, const cv::Mat& translation) {
  const auto vector = [](const cv::Mat& m) {
    return Vector3d(m.at<double>(0), m.at<double>(1), m.at<double>(2));
  };
  return {expSO3(vector(rotation)), vector(translation)};
}

class Ransac {
 public:
  Ransac(const std::vector<PointMatch>& matches, const Camera& camera, double diameter,
         const DetectorOptions& options, const Random& random, uint32_t frame)
      : matches_(matches),
        camera_(camera),
        diameter_(diameter),
        options_(options),
        random_(random),
        frame_(frame) {
    for (const PointMatch& match : matches)
      rays_.push_back(camera.unproject(match.u_px).value_or(Vector3d(0, 0, 1)));
  }

  std::optional<RansacPose> run();

 private:
  std::vector<int> draw(int sample) const;
  int samplesNeeded(size_t inliers) const;
  std::vector<SE3> solve(const std::vector<int>& chosen) const;
  std::vector<int> inliers(const SE3& T) const {
    return agreeingMatches(matches_, camera_, T, options_.inlier_px);
  }
  SE3 refine(const SE3& T, const std::vector<int>& used) const;
  double spread(const std::vector<int>& inliers) const;

  const std::vector<PointMatch>& matches_;
  const Camera& camera_;
  double diameter_;
  const DetectorOptions& options_;
  const Random& random_;
  uint32_t frame_;
  std::vector<Vector3d> rays_;  // z = 1
};

// A match at random, and others that were seen from the same side.
std::vector<int> Ransac::draw(int sample) const {
  const int size = options_.solver == "epnp" ? kEpnpSize : kP3pSize;
  const double n = static_cast<double>(matches_.size());
  std::vector<int> chosen;
  uint64_t index = static_cast<uint64_t>(sample) * 16;
  const auto next = [&](int k) {
    return static_cast<int>(n * random_.uniform(frame_, index)[static_cast<size_t>(k)]);
  };
  chosen.push_back(next(0));
  const Vector3d& side = matches_[static_cast<size_t>(chosen[0])].view_direction;
  for (int draws = 0; static_cast<int>(chosen.size()) < size && draws < kDraws; ++draws) {
    ++index;
    for (int k = 0; k < 4 && static_cast<int>(chosen.size()) < size; ++k) {
      const int candidate = next(k);
      const bool taken = std::find(chosen.begin(), chosen.end(), candidate) != chosen.end();
      if (!taken && matches_[static_cast<size_t>(candidate)].view_direction.dot(side) > kSameSide)
        chosen.push_back(candidate);
    }
  }
  if (static_cast<int>(chosen.size()) < size) return {};
  const auto place = [&](size_t k) { return matches_[static_cast<size_t>(chosen[k])].p_object; };
  const Vector3d a = place(1) - place(0), b = place(2) - place(0);
  if (!(a.cross(b).norm() >
        kDegenerate * diameter_ * diameter_ * kDegenerate + kDegenerate * a.norm() * b.norm()))
    return {};
  return chosen;
}

std::vector<SE3> Ransac::solve(const std::vector<int>& chosen) const {
  std::vector<cv::Point3d> places;
  std::vector<cv::Point2d> pixels;
  for (const int i : chosen) {
    const Vector3d& p = matches_[static_cast<size_t>(i)].p_object;
    const Vector3d& ray = rays_[static_cast<size_t>(i)];
    places.emplace_back(p.x(), p.y(), p.z());
    pixels.emplace_back(ray.x(), ray.y());
  }
  const cv::Matx33d identity = cv::Matx33d::eye();
  std::vector<SE3> poses;
  if (options_.solver == "epnp") {
    cv::Mat rotation, translation;
    if (cv::solvePnP(places, pixels, identity, cv::noArray(), rotation, translation, false,
                     cv::SOLVEPNP_EPNP))
      poses.push_back(toPose(rotation, translation));
    return poses;
  }
  std::vector<cv::Mat> rotations, translations;
  cv::solveP3P(places, pixels, identity, cv::noArray(), rotations, translations, cv::SOLVEPNP_AP3P);
  for (size_t k = 0; k < rotations.size(); ++k)
    poses.push_back(toPose(rotations[k], translations[k]));
  return poses;
}

// So many that one of inliers alone is among them, but for one case in a million.
int Ransac::samplesNeeded(size_t inliers) const {
  constexpr double kLogMiss = -13.8;
  const double share = static_cast<double>(inliers) / static_cast<double>(matches_.size());
  const double good = std::pow(share, options_.solver == "epnp" ? kEpnpSize : kP3pSize);
  if (good >= 1) return 1;
  return static_cast<int>(std::min(kLogMiss / std::log1p(-good) + 1, 1e9));
}

SE3 Ransac::refine(const SE3& T, const std::vector<int>& used) const {
  PointCue cue(matches_, used, camera_, kSigma * options_.inlier_px);
  Cue* const cues[] = {&cue};
  SolverLimits limits;
  limits.iterations = 10;
  limits.model_diameter = diameter_;
  return solvePose(T, cues, limits).T_camera_model;
}

double Ransac::spread(const std::vector<int>& inliers) const {
  Vector3d mean = Vector3d::Zero();
  for (const int i : inliers) mean += matches_[static_cast<size_t>(i)].p_object;
  mean /= static_cast<double>(inliers.size());
  double squares = 0;
  for (const int i : inliers)
    squares += (matches_[static_cast<size_t>(i)].p_object - mean).squaredNorm();
  return std::sqrt(squares / static_cast<double>(inliers.size()));
}

std::optional<RansacPose> Ransac::run() {
  if (matches_.size() < static_cast<size_t>(options_.min_inliers)) return std::nullopt;
  RansacPose best;
  int needed = options_.samples;
  for (int sample = 0; sample < needed; ++sample) {
    const std::vector<int> chosen = draw(sample);
    if (chosen.empty()) continue;
    for (const SE3& T : solve(chosen)) {
      if (!T.isFinite()) continue;
      std::vector<int> agreeing = inliers(T);
      if (agreeing.size() <= best.inliers.size()) continue;
      best = {T, std::move(agreeing)};
      needed = std::min(needed, samplesNeeded(best.inliers.size()));
    }
  }
  for (int round = 0; round < 3 && best.inliers.size() >= 4; ++round) {
    const SE3 T = refine(best.T_camera_object, best.inliers);
    std::vector<int> agreeing = inliers(T);
    if (agreeing.size() < best.inliers.size()) break;
    best = {T, std::move(agreeing)};
  }
  if (best.inliers.size() < static_cast<size_t>(options_.min_inliers) ||
      spread(best.inliers) < options_.min_spread * diameter_)
    return std::nullopt;
  return best;
}

}  // namespace

std::vector<int> agreeingMatches(const std::vector<PointMatch>& matches, const Camera& camera,
                                 const SE3& T, double inlier_px) {
  constexpr double kSamePixel = 1;
  const Vector3d eye = T.inverse().translation;
  std::vector<int> found;
  for (size_t i = 0; i < matches.size(); ++i) {
    const PointMatch& match = matches[i];
    if (!(errorPx(T, camera, match) < inlier_px)) continue;
    if ((eye - match.p_object).dot(match.view_direction) <= 0) continue;  // seen from behind
    const bool repeated = std::any_of(found.begin(), found.end(), [&](int k) {
      return (matches[static_cast<size_t>(k)].u_px - match.u_px).norm() < kSamePixel;
    });
    if (!repeated) found.push_back(static_cast<int>(i));
  }
  return found;
}

Matrix6d covarianceByMatches(const std::vector<PointMatch>& matches, const std::vector<int>& used,
                             const Camera& camera, const SE3& T, double inlier_px) {
  constexpr double kShared = 4;  // so many matches tell as much as one
  PointCue cue(matches, used, camera, kSigma * inlier_px);
  return covarianceFromHessian(cue.linearise(T).hessian / kShared, 1, 1);
}

std::optional<RansacPose> findPose(const std::vector<PointMatch>& matches, const Camera& camera,
                                   double diameter, const DetectorOptions& options,
                                   const Random& random, uint32_t frame) {
  return Ransac(matches, camera, diameter, options, random, frame).run();
}

SE3 tiltedTheOtherWay(const SE3& T, const std::vector<PointMatch>& matches,
                      const std::vector<int>& inliers) {
  Vector3d mean = Vector3d::Zero();
  for (const int i : inliers) mean += matches[static_cast<size_t>(i)].p_object;
  mean /= static_cast<double>(inliers.size());
  Matrix3d scatter = Matrix3d::Zero();
  for (const int i : inliers) {
    const Vector3d d = matches[static_cast<size_t>(i)].p_object - mean;
    scatter += d * d.transpose();
  }
  const Vector3d centre = T * mean, line_of_sight = centre.normalized();
  const Vector3d normal =
      T.rotation * Eigen::SelfAdjointEigenSolver<Matrix3d>(scatter).eigenvectors().col(0);
  const Vector3d mirrored = 2 * normal.dot(line_of_sight) * line_of_sight - normal;
  const Eigen::Quaterniond turn = Eigen::Quaterniond::FromTwoVectors(normal, mirrored);
  return {(turn * T.rotation).normalized(), centre - turn * (T.rotation * mean)};
}

}  // namespace diorama
