// Incremental smoothing of the graph: camera poses in the order of time, objects last.
//
// One step adds a pose and eliminates the one before it into a clique (RootSystem), absorbs what is
// seen from the new pose, and solves the root; that gives the exact joint covariance of the newest
// pose and the objects in use. Older poses follow by back-substitution as far down as they change.
// Residuals are linearised where their variables stand at that time. When variables have moved far
// from their charts, the newest poses are done anew from a stored root, or all of them: by a pass
// that does some of the old poses in each step, beside the chain in use, and takes its place when
// it arrives at the newest pose. So no step costs much more than another.
//
// Objects that were not seen for long can be eliminated, too, when there are many; one that comes
// back is brought back by a replay from where it went, and everything is as if it had never gone.
#pragma once

#include <cstdint>
#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/options.h"
#include "mapper/graph.h"
#include "mapper/joint_belief.h"
#include "mapper/root_system.h"

namespace diorama {

struct SmootherOptions {
  int window_poses = 64;  // roots of so many newest poses are kept for replays
  // Back-substitution in the window goes on while a pose changes by more than this (m, rad). Older
  // poses follow when everything might be linearised anew, and when they are asked for.
  double wildfire = 1e-3;
  // A pose of the window that moved so far from its chart (m, rad) is linearised anew.
  double relinearise_window = 0.01;
  // Everything is, when an object or the poses (root mean square) moved so far, but only after at
  // least this part of the trajectory has been added since that was looked at last.
  double relinearise_m = 0.02;
  double relinearise_rad = 0.02;
  double relinearise_growth = 0.05;
  // So many poses a step are linearised anew in a pass over everything; four times as many are
  // back-substituted, which costs much less, before it is known whether they moved.
  int pass_poses = 32;
  // The root is solved after so many steps at least. Between, the belief is carried on in
  // covariance form, which is the same but for rounding.
  int solve_every = 16;
  // With more objects than `active_objects`, those that were not seen in this many poses are
  // eliminated.
  int active_objects = 16;
  int dormant_after_poses = 60;

  template <class V>
  void visit(V& v) {
    v("window_poses", window_poses, Range{2, 10000});
    v("wildfire", wildfire, kNotNegative);
    v("relinearise_window", relinearise_window, kPositive);
    v("relinearise_m", relinearise_m, kPositive);
    v("relinearise_rad", relinearise_rad, kPositive);
    v("relinearise_growth", relinearise_growth, kNotNegative);
    v("pass_poses", pass_poses, Range{1, 1000000});
    v("solve_every", solve_every, Range{1, 1000});
    v("active_objects", active_objects, Range{1, 1000000});
    v("dormant_after_poses", dormant_after_poses, Range{1, 1000000000});
  }
};

class ChainSmoother {
 public:
  ChainSmoother(const SmootherOptions& options, const RobustKernel& object_kernel,
                const RobustKernel& odometry_kernel);

  // An empty graph whose first pose is the fixed identity. Must come first.
  void start(int64_t timestamp_ns);

  // Appends a pose where the odometry puts it. Its scale, if it has one, must have been added.
  void addPose(int64_t timestamp_ns, const OdometryFactor& odometry);
  // A new object; it enters the graph with its first observation.
  size_t addObject(const std::string& name, const SE3& T_world_object);
  // A scale that nobody knows but within this (one sigma): a variable among the objects.
  size_t addScale(double sigma);
  // Any pose: an old one costs a replay from there on, one older than the window of everything.
  void addObservation(size_t pose, const ObjectFactor& factor);

  // Forgets what was seen of an object from a pose and all later ones; returns how many
  // observations are left. A replay from there on.
  size_t removeObservations(size_t object, size_t from_pose);

  // Nothing more will be seen of it: update() eliminates it, however few objects there are.
  void release(size_t object) { objects_[object].released = true; }

  // Squared innovation of an observation that has not been added, given all that was added for
  // poses up to its own; nothing when the object is not in the graph there or the pose is older
  // than the window.
  std::optional<double> innovation(size_t pose, const ObjectFactor& factor);

  // Back-substitutes, linearises anew what moved too far.
  void update();
  // Brings all poses up to date; after update() those of the window are.
  void sweep();
  // One Gauss-Newton step over everything. Returns the largest step (m, rad).
  double relinearise();
  // Takes over the values of another solution of the same graph and linearises there.
  void moveTo(const Graph& values);

  size_t poseCount() const { return graph_.poses.size(); }
  size_t objectCount() const { return graph_.objects.size(); }
  bool inWindow(size_t pose) const;
  int64_t timestamp_ns(size_t pose) const { return graph_.poses[pose].timestamp_ns; }
  SE3 T_world_camera(size_t pose) const;
  SE3 T_world_object(size_t object) const;
  double logScale(size_t object) const { return T_world_object(object).translation.x(); }
  Graph estimate() const;  // the graph with the present values

  // Covariance in the right tangents of the present values, [camera, slots...]. Exact at the point
  // of linearisation.
  struct Joint {
    Eigen::MatrixXd P;
    ObjectSlots slots;
  };
  Joint joint() const;
  // The same of the newest camera pose and one object. Of one that was eliminated: its covariance
  // as it was then, without the correlation.
  struct PairCovariance {
    Matrix6d camera, cross, object;
  };
  PairCovariance covarianceWith(size_t object) const;
  Matrix6d objectCovariance(size_t object) const;  // of these, the object's alone
  Matrix6d cameraCovariance() const;               // of the newest pose
  bool isActive(size_t object) const { return root_.holds(object); }

 private:
  struct ObjectState {
    Vector6d delta = Vector6d::Zero();   // from the chart in graph_
    Vector6d looked = Vector6d::Zero();  // the same when a pass began last
    size_t last_seen = 0;                // pose
    bool released = false;
    std::optional<size_t> dropped_at = {};  // pose after which it was eliminated
    Matrix6d dormant_P = Matrix6d::Identity();
  };
  struct Drop {
    size_t object;
    Clique clique;
  };
  struct DropsOfPose {
    RootSystem before;  // as of arriving at the pose
    std::vector<Drop> drops;
  };
  struct SavedRoot {
    size_t pose = 0;
    bool valid = false;
    RootSystem root;
  };

  // A pass over everything, a part in each step: back over all poses, when they may have moved,
  // and, when that was far, forward again. What the forward part has passed stands in the new
  // charts of objects; the window, and all that is read between, in the old ones until it arrives.
  struct Pass {
    enum class Stage { kIdle, kBack, kForward } stage = Stage::kIdle;
    size_t at = 0;             // back: poses from here on are done; forward: poses before are
    RootSystem root;           // as of arriving at `at`
    std::vector<SE3> objects;  // the new charts
  };

  size_t newest() const { return graph_.poses.size() - 1; }
  size_t oldestOfWindow() const { return newest() - std::min(newest(), saved_.size() - 1); }
  ChartStep odometryPair(size_t from, const Pass* pass = nullptr) const;
  ChartPair objectPair(size_t pose, const ObjectFactor& factor, const Pass* pass = nullptr) const;
  void saveRoot(size_t pose);
  const RootSystem* savedRoot(size_t pose) const;
  void settle(RootSystem& root, size_t pose, const Pass* pass = nullptr);
  void replayFrom(size_t pose);
  void replayOn(size_t pose);
  void solveRoot();
  void carryOn();
  void takeOver();
  void awaken(size_t object);
  void dropDormant();
  std::optional<size_t> nextToDrop() const;
  bool backSubstitute(size_t oldest);
  double backSubstituteOne(size_t pose);
  Vector6d solveClique(const Clique& clique, const Vector6d& camera) const;
  void setPoseDelta(size_t pose, const Vector6d& delta);
  bool movedFar() const;
  bool mayHaveMoved() const;
  void relineariseWindow();
  void relinearisePose(size_t pose);
  void startOver();
  void advancePass();
  void passBack();
  void passForward();
  void finishPass();
  void finishPassBefore(size_t pose);

  SmootherOptions options_;
  Graph graph_;  // charts
  std::deque<Vector6d> pose_deltas_;
  std::vector<ObjectState> objects_;
  std::deque<Clique> cliques_;  // [k] of pose k, all but the newest
  std::map<size_t, DropsOfPose> drops_;
  std::vector<SavedRoot> saved_;
  RootSystem root_;
  JointBelief belief_;
  int steps_since_solve_ = 0;
  Pass pass_;
  size_t poses_at_pass_ = 0;
  bool older_moved_ = false;                // than the window, since then
  double squares_m_ = 0, squares_rad_ = 0;  // sums over pose_deltas_
};

}  // namespace diorama
