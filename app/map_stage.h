// The map: takes what the stages say of each frame, whenever it comes, keeps the counters of the
// paper's Algorithm 1, and says what is believed of the frame then, and where objects are to be
// looked for.
//
// A frame's estimate is taken when the odometry is done with the frame: with what had come until
// then of its objects; no later frame is in it.
#pragma once

#include <deque>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "app/camera_motion.h"
#include "app/camera_stage.h"
#include "app/object_stage.h"
#include "app/pipeline_types.h"
#include "mapper/mapper.h"

namespace diorama {

// A stage was behind and has not looked at a frame.
struct Drop {
  std::optional<size_t> object;  // whose tracker; otherwise the odometry
  int64_t timestamp_ns = 0;
};

using Message = std::variant<CameraStep, CameraUpdate, Sighting, Drop>;

class MapStage {
 public:
  MapStage(Method method, const std::vector<PipelineObject>& objects,
           const MapperOptions& mapper_options, const PipelineOptions& options);

  // Of each frame: a step and an update of the camera (none in ebt) and a sighting of each object,
  // or the note that it was dropped; those of one stage in the order of time.
  void take(Message message);
  // Smooths, when late measurements have come.
  void update();
  // Frames, in the order of time, of which everything has been said.
  std::vector<FrameResult> finished();

  const std::vector<std::string>& names() const { return names_; }
  // The standing of an object, without and with its prediction at some time.
  Guidance standing(size_t object) const;
  Guidance guide(size_t object, int64_t timestamp_ns) const;
  // Of the camera between the newest frames; predictions can be carried on with it.
  const CameraMotion& motion() const { return motion_; }
  int64_t newest_ns() const { return newest_ns_; }

  FinalEstimate finish();

 private:
  struct OpenFrame {
    FrameResult result;
    std::vector<std::optional<Sighting>> waiting;  // for a pose, or until the camera is done
    std::vector<bool> excused;                     // heard of, or dropped
    size_t sightings_left = 0;
    bool settled = false, without_camera = false, by_map = false;
  };
  struct Counter {
    int rejected = 0, missed_frames = 0;
    std::optional<int64_t> heard_ns = {};
    bool overdue = false;
    bool begun = false;                       // a start was found for it
    std::optional<SE3> T_world_object = {};   // where its start put it; vo
    std::optional<SE3> T_camera_object = {};  // where the odometry has placed it; vo
  };

  void receive(CameraStep step);
  void receive(CameraUpdate update);
  void receive(Sighting sighting);
  void receive(const Drop& drop);
  OpenFrame& frameAt(int64_t timestamp_ns);
  void moveMap(const CameraStep& step, FrameResult& result);
  bool startMap(int64_t timestamp_ns, bool odometry_started);
  void settle(OpenFrame& frame);
  void apply(OpenFrame& frame, const Sighting& sighting);
  void follow(const StampedPose& camera);
  void addToMap(OpenFrame& frame, size_t object, const ObjectMeasurement& measurement);
  void place(const StampedPose& start, Counter& counter) const;
  void noteHeard(OpenFrame& frame, size_t object);
  void noteAbsences(OpenFrame& frame);
  void report(OpenFrame& frame);
  std::optional<SE3> carriedByOdometry(const Counter& counter) const;

  Method method_;
  PipelineOptions options_;
  std::vector<std::string> names_;
  std::vector<Counter> counters_;
  Mapper mapper_;
  std::deque<OpenFrame> open_;
  CameraMotion motion_;
  Trajectory path_;     // by odometry alone; beside a map its newest pose
  SE3 T_world_camera_;  // its newest pose
  int64_t newest_ns_ = 0;
  bool wants_objects_ = false;
  bool odometry_gap_ = false;  // the last frame's motion did not enter the map
  bool dirty_ = false;         // something came after the last update
  std::optional<int64_t> first_ns_;
};

}  // namespace diorama
