// Which measurement belongs to which object: the gate, and what waits outside of it.
//
// Each label (an object's name) has landmarks, static things that were measured as that object. A
// measurement joins the best supported one when it is inside its gate, else the one whose
// innovation is smallest and inside the gate. Others wait in a tentative list; as soon as some
// agree with one another they make a landmark of their own. The label stands for its best supported
// landmark, so that a first measurement that was wrong, or static clutter, ends as another landmark
// that does no harm. What takes next to none of a label's measurements is forgotten: it is the tail
// of the noise.
#pragma once

#include <deque>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "core/measurements.h"
#include "core/object_model.h"
#include "core/options.h"
#include "mapper/chain_smoother.h"

namespace diorama {

struct GateOptions {
  // innovation: r^T S^-1 r below chi_square, S the covariance of the innovation by the joint
  // belief, renewed after each measurement (sequential compatibility, Neira and Tardos 2001).
  // paper: e^T Sigma^-1 e <= alpha^2 with the error in the world and the object's covariance alone
  // (Singhal et al. 2016, alpha 2). none: everything is believed.
  std::string kind = "innovation";
  double chi_square = 22.46;  // 99.9% with 6 degrees of freedom
  double paper_alpha = 2;
  int support = 3;         // measurements that agree make a landmark
  int max_landmarks = 12;  // of a label
  int max_tentative = 100;
  // A landmark, or measurements that wait, are forgotten when they are less than this part of what
  // the label's landmarks have taken since. The gate turns 0.1% of good measurements away; those
  // agree with one another, too, and would in time make landmarks beside the true one.
  double least_share = 0.02;
  // Two measurements that wait agree within their covariances plus this, for the camera's drift
  // between them.
  double slack_m = 0.01;
  double slack_rad = 0.01;

  template <class V>
  void visit(V& v) {
    v("kind", kind, std::vector<std::string>{"innovation", "paper", "none"});
    v("chi_square", chi_square, kPositive);
    v("paper_alpha", paper_alpha, kPositive);
    v("support", support, Range{1, 1000});
    v("max_landmarks", max_landmarks, Range{1, 1000});
    v("max_tentative", max_tentative, Range{1, 100000});
    v("least_share", least_share, kFraction);
    v("slack_m", slack_m, kNotNegative);
    v("slack_rad", slack_rad, kNotNegative);
  }
};

// What became of a measurement. One that was not added has not changed what the map says.
struct [[nodiscard]] AddResult {
  bool added = false;
  std::string reason = {};  // why not; empty when it was added
  // Normalised innovation against the landmark that the label stands for, where there is one.
  std::optional<double> innovation = {};
  // "moving" or "resting", when it made that certain of the object; `reason` says more.
  std::string decision = {};
  explicit operator bool() const { return added; }
};

class Landmarks {
 public:
  explicit Landmarks(const GateOptions& options) : options_(options) {}

  void setSymmetries(const std::string& label, const Symmetries& symmetries);

  // The factor's `object` is decided here.
  AddResult add(ChainSmoother& smoother, size_t pose, const std::string& label,
                ObjectFactor factor);

  // Takes the support of all landmarks of a label away: the next ones that are measured win.
  void doubt(const std::string& label);

  // The object moves since a pose: what was seen of it from there on is taken out of the graph, and
  // landmarks of which nothing is left are forgotten.
  void takeBack(ChainSmoother& smoother, const std::string& label, size_t from_pose);
  // It has come to rest where it was measured: at a landmark of its, or at a new one, for which the
  // label stands from now on.
  void settle(ChainSmoother& smoother, size_t pose, const std::string& label, ObjectFactor factor);

  // In the order of their first measurement.
  const std::vector<std::string>& labels() const { return order_; }
  // The landmark that a label stands for; nothing for one that was never measured.
  std::optional<size_t> best(const std::string& label) const;

 private:
  struct Landmark {
    size_t object;         // number in the graph
    int taken_before = 0;  // by the label's landmarks before there was this one
    int taken = 0;
    // Measurements that follow one another share their cause, so that a run of n counts as sqrt(n).
    double past_runs = 0;
    int run = 0;
    double support() const;
  };
  struct Waiting {
    size_t pose;
    ObjectFactor factor;
  };
  struct Tentative {
    int taken_before = 0;          // as above
    std::vector<Waiting> members;  // that agree
  };
  struct Label {
    Symmetries symmetries;
    std::vector<Landmark> landmarks;
    std::deque<Tentative> tentative;
    int taken = 0;  // by all landmarks
  };
  struct Match {
    Landmark* landmark = nullptr;
    ObjectFactor factor;
    double distance = 0;
  };

  std::optional<Match> nearest(ChainSmoother& smoother, size_t pose, Label& label,
                               const ObjectFactor& factor, std::optional<double>& best) const;
  double distance(ChainSmoother& smoother, size_t pose, const ObjectFactor& factor) const;
  static double roughDistance(const ChainSmoother& smoother, size_t pose,
                              const ObjectFactor& factor);
  double limit() const;
  Landmark& place(ChainSmoother& smoother, size_t pose, const std::string& name, Label& label,
                  const ObjectFactor& factor) const;
  bool wait(ChainSmoother& smoother, size_t pose, const std::string& name, Label& label,
            const ObjectFactor& factor) const;
  bool agree(const ChainSmoother& smoother, const Waiting& waiting, size_t pose,
             const ObjectFactor& factor) const;
  static const Landmark& bestOf(const Label& label);
  static void count(Label& label, Landmark* matched);
  void forget(ChainSmoother& smoother, Label& label) const;

  GateOptions options_;
  std::map<std::string, Label> labels_;  // also those that were only declared
  std::vector<std::string> order_;
};

// The same measurement of a symmetric object, in the way that is nearest to the expected pose.
ObjectFactor nearestBySymmetry(const ObjectFactor& factor, const SE3& T_camera_object,
                               const Symmetries& symmetries);

}  // namespace diorama
