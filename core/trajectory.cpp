#include "core/trajectory.h"

#include <algorithm>
#include <cstdlib>

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {

const StampedPose* Trajectory::nearest(int64_t timestamp_ns, int64_t max_gap_ns) const {
  const auto after = std::lower_bound(
      poses.begin(), poses.end(), timestamp_ns,
      [](const StampedPose& pose, int64_t time) { return pose.timestamp_ns < time; });
  const StampedPose* best = nullptr;
  const auto consider = [&](const StampedPose& pose) {
    const int64_t gap = std::abs(pose.timestamp_ns - timestamp_ns);
    if (gap <= max_gap_ns && (!best || gap < std::abs(best->timestamp_ns - timestamp_ns)))
      best = &pose;
  };
  if (after != poses.begin()) consider(*std::prev(after));
  if (after != poses.end()) consider(*after);
  return best;
}

Trajectory readTum(const std::filesystem::path& file) {
  const std::string content = readFile(file);
  Trajectory trajectory;
  int number = 0;
  for (std::string_view line : split(content, '\n')) {
    ++number;
    line = trim(line);
    if (line.empty() || line.front() == '#') continue;
    const SourcePlace place{file.string(), number};
    const std::vector<std::string_view> fields = splitBlanks(line);
    const std::string expected = "expected `timestamp tx ty tz qx qy qz qw`";
    if (fields.size() != 8)
      throw InputError(place, std::to_string(fields.size()) + " fields instead of 8", expected);
    const std::optional<int64_t> time = parseSeconds(fields[0]);
    if (!time) throw InputError(place, "the time stamp is no number of seconds", expected);
    const std::optional<SE3> pose = parsePose(fields, 1);
    if (!pose)
      throw InputError(place, "the pose is not finite or its quaternion is zero", expected);
    if (!trajectory.poses.empty() && *time <= trajectory.poses.back().timestamp_ns)
      throw InputError(place, "the time stamps must increase");
    trajectory.poses.push_back({*time, *pose});
  }
  return trajectory;
}

std::string toTum(const Trajectory& trajectory, const std::string& header) {
  std::string text = header;
  for (const StampedPose& pose : trajectory.poses) text += toTum(pose);
  return text;
}

std::string toTum(const StampedPose& pose) {
  return formatSeconds(pose.timestamp_ns) + " " + formatPose(pose.pose, ' ') + "\n";
}

}  // namespace diorama
