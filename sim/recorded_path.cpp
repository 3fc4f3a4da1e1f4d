// Camera motion that was recorded elsewhere.
#include <string>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"
#include "sim/motion_path.h"

namespace diorama {
namespace {

// `timestamp_ns, px, py, pz, qw, qx, qy, qz, ...`
Trajectory readEuroc(const std::filesystem::path& file) {
  const std::string content = readFile(file);
  Trajectory recording;
  int number = 0;
  for (std::string_view line : split(content, '\n')) {
    ++number;
    line = trim(line);
    if (line.empty() || line.front() == '#') continue;
    const SourcePlace place{file.string(), number};
    std::vector<std::string_view> fields = split(line, ',');
    if (fields.size() < 8) throw InputError(place, "expected `timestamp_ns,px,py,pz,qw,qx,qy,qz`");
    for (std::string_view& field : fields) field = trim(field);
    const std::optional<int64_t> time = parseInteger(fields[0]);
    if (!time) throw InputError(place, "the timestamp is no whole number of nanoseconds");
    const std::vector<std::string_view> pose_fields{fields[1], fields[2], fields[3], fields[5],
                                                    fields[6], fields[7], fields[4]};
    const std::optional<SE3> pose = parsePose(pose_fields, 0);
    if (!pose) throw InputError(place, "the pose is not finite or its quaternion is zero");
    if (!recording.poses.empty() && *time <= recording.poses.back().timestamp_ns)
      throw InputError(place, "the times do not increase");
    recording.poses.push_back({*time, *pose});
  }
  return recording;
}

}  // namespace

Trajectory readRecording(const std::filesystem::path& file, RecordingFormat format) {
  Trajectory recording = format == RecordingFormat::kTum ? readTum(file) : readEuroc(file);
  if (recording.poses.empty()) throw InputError(file, "has no poses");
  for (StampedPose& stamped : recording.poses) stamped.pose.rotation.normalize();
  return recording;
}

}  // namespace diorama
