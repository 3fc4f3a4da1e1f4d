#include "sim/sequence_check_files.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>
#include <set>

#include "core/errors.h"
#include "core/files.h"
#include "core/measurements_io.h"
#include "core/sha256.h"
#include "core/text.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

// Calls f(place, fields) for each line after the header.
template <class F>
void forEachRow(const fs::path& file, size_t columns, const F& f) {
  const std::string content = readFile(file);
  int number = 0;
  for (std::string_view line : split(content, '\n')) {
    ++number;
    line = trim(line);
    if (line.empty() || number == 1) continue;
    const SourcePlace place{file.string(), number};
    const std::vector<std::string_view> fields = split(line, ',');
    if (fields.size() < columns)
      throw InputError(place, "expected " + std::to_string(columns) + " columns");
    f(place, fields);
  }
}

}  // namespace

FileSums readManifest(const fs::path& file) {
  FileSums sums;
  forEachRow(file, 2, [&](const SourcePlace& place, const auto& fields) {
    const fs::path name(fields[0]);
    if (name.empty() || name.is_absolute() || *name.lexically_normal().begin() == "..")
      throw InputError(place, "names no file of the sequence");
    sums.emplace_back(fields[0], trim(fields[1]));
  });
  return sums;
}

void checkSums(const fs::path& folder, const FileSums& sums, size_t first, size_t end,
               CheckResult& result) {
  for (size_t i = first; i < end; ++i) {
    const auto& [name, sum] = sums[i];
    result.count(Check::kFiles, 1);
    try {
      if (sha256(readFile(folder / name)) != sum)
        result.add(Check::kFiles, name, "is not the file that was written (SHA-256)");
    } catch (const MissingInputError&) {
      result.add(Check::kFiles, name, "is in the manifest, but not there");
    }
  }
}

std::map<std::string, uint16_t> readInstances(const fs::path& file) {
  std::map<std::string, uint16_t> ids;
  forEachRow(file, 2, [&](const SourcePlace& place, const auto& fields) {
    const auto id = parseInteger(fields[0]);
    if (!id || *id < 1 || *id > 65535) throw InputError(place, "the id is no number from 1 on");
    if (!ids.emplace(fields[1], static_cast<uint16_t>(*id)).second)
      throw InputError(place, "`" + std::string(fields[1]) + "` stands twice");
  });
  return ids;
}

void checkVisibilityRows(const SequenceReader& sequence, const fs::path& file,
                         CheckResult& result) {
  const std::string name = file.filename().string();
  std::set<std::pair<int64_t, std::string>> rows;
  forEachRow(file, 6, [&](const SourcePlace& place, const auto& fields) {
    const auto frame = parseInteger(fields[0]), all = parseInteger(fields[2]),
               valid = parseInteger(fields[3]), visible = parseInteger(fields[4]);
    const auto fraction = parseNumber(fields[5]);
    if (!frame || !all || !valid || !visible || !fraction)
      throw InputError(place, "is no row of numbers");
    const std::string line = "line " + std::to_string(place.line) + ": ";
    if (!rows.emplace(*frame, fields[1]).second)
      result.add(Check::kVisibility, name, line + "stands twice");
    if (!(*visible <= *valid && *valid <= *all))
      result.add(Check::kVisibility, name, line + "more pixels are visible than there are");
    const double expected =
        *all == 0 ? 0 : static_cast<double>(*visible) / static_cast<double>(*all);
    if (!(std::abs(*fraction - expected) < 1e-6))
      result.add(Check::kVisibility, name, line + "the fraction is not that of the counts");
  });
  for (int k = 0; k < sequence.frameCount(); ++k)
    for (const SequenceObject& object : sequence.objects())
      if (!rows.contains({sequence.frameNumber(k), object.name}))
        result.add(Check::kVisibility, name,
                   "has no row for " + object.name + " in frame " +
                       std::to_string(sequence.frameNumber(k)));
}

namespace {

struct TimedFile {
  std::string name;
  std::set<int64_t> times_ns;
};

std::vector<TimedFile> timedFiles(const SequenceReader& sequence) {
  std::vector<TimedFile> files;
  const auto add = [&](const std::string& name, const Trajectory& path) {
    if (path.poses.empty()) return;
    files.push_back({name, {}});
    for (const StampedPose& pose : path.poses) files.back().times_ns.insert(pose.timestamp_ns);
  };
  add("groundtruth.txt", sequence.trueCameraPath());
  for (size_t i = 0; i < sequence.objects().size(); ++i)
    add("objects/" + sequence.objects()[i].name + ".txt", sequence.trueObjectPaths()[i]);
  if (!sequence.depthImages().empty()) {
    files.push_back({"depth.txt", {}});
    for (const ImageEntry& entry : sequence.depthImages())
      files.back().times_ns.insert(entry.timestamp_ns);
  }
  return files;
}

}  // namespace

void checkTimes(const SequenceReader& sequence, CheckResult& result) {
  std::set<int64_t> frames_ns;
  for (const ImageEntry& image : sequence.images()) frames_ns.insert(image.timestamp_ns);
  std::vector<TimedFile> files = timedFiles(sequence);
  std::erase_if(files, [&](const TimedFile& file) {
    const auto same = std::count_if(frames_ns.begin(), frames_ns.end(),
                                    [&](int64_t t) { return file.times_ns.contains(t); });
    return 2 * static_cast<size_t>(same) < frames_ns.size();
  });
  result.count(Check::kTimes, static_cast<int64_t>(frames_ns.size() * (files.size() + 1)));
  for (int64_t time : frames_ns) {
    std::vector<std::string> without;
    for (const TimedFile& file : files)
      if (!file.times_ns.contains(time)) without.push_back(file.name);
    // When no file knows a time, it is the list of images that is wrong.
    if (without.size() > 1 && without.size() == files.size()) without = {"rgb.txt"};
    for (const std::string& file : without)
      result.add(Check::kTimes, file,
                 (file == "rgb.txt" ? "no other file has the time " : "does not have the time ") +
                     formatSeconds(time));
  }
}

namespace {

void checkResting(const std::string& file, const Trajectory& path, CheckResult& result) {
  const auto same = [](const SE3& a, const SE3& b) {
    return a.translation == b.translation && a.rotation.coeffs() == b.rotation.coeffs();
  };
  for (size_t k = 1; k + 1 < path.poses.size(); ++k)
    if (same(path.poses[k - 1].pose, path.poses[k + 1].pose) &&
        !same(path.poses[k].pose, path.poses[k + 1].pose))
      result.add(Check::kPoses, file,
                 "at " + formatSeconds(path.poses[k].timestamp_ns) +
                     " the resting object has another pose than before and after");
}

// The squared normalised difference between the odometry's steps and the true motion.
struct OdometryStep {
  int64_t from_ns = 0, to_ns = 0;
  double distance = 0;
};

std::vector<OdometryStep> compareOdometry(const SequenceReader& sequence) {
  std::vector<OdometryStep> steps;
  const Trajectory& path = sequence.trueCameraPath();
  for (const OdometryMeasurement& m : readMeasurements(*sequence.odometryFile()).odometry) {
    const StampedPose *from = path.nearest(m.from_ns, 0), *to = path.nearest(m.to_ns, 0);
    if (m.source != "simulated" || !(m.health > 0) || !from || !to) continue;
    const Vector6d e = log(m.T_from_to.inverse() * from->pose.inverse() * to->pose);
    steps.push_back({m.from_ns, m.to_ns, e.dot(m.covariance.ldlt().solve(e))});
  }
  return steps;
}

// A wrong pose spoils the step before it and the one after.
void checkOdometry(const SequenceReader& sequence, CheckResult& result) {
  // Chi-square with 12 and 6 degrees of freedom: less than 1e-9 of good steps are above.
  constexpr double kBoth = 70, kOne = 52;
  if (!sequence.odometryFile()) return;
  const std::vector<OdometryStep> steps = compareOdometry(sequence);
  for (size_t i = 0; i <= steps.size() && !steps.empty(); ++i) {
    const OdometryStep* before = i > 0 ? &steps[i - 1] : nullptr;
    const OdometryStep* after = i < steps.size() ? &steps[i] : nullptr;
    if (before && after && before->to_ns != after->from_ns) continue;
    const double distance = (before ? before->distance : 0) + (after ? after->distance : 0);
    const auto least = [&](const OdometryStep* step) { return !step || step->distance > 20; };
    if (distance > (before && after ? kBoth : kOne) && least(before) && least(after))
      result.add(Check::kPoses, "groundtruth.txt",
                 "at " + formatSeconds(before ? before->to_ns : after->from_ns) +
                     " the camera is not where its odometry has it");
  }
}

}  // namespace

void checkPaths(const SequenceReader& sequence, CheckResult& result) {
  for (size_t i = 0; i < sequence.objects().size(); ++i) {
    const SequenceObject& object = sequence.objects()[i];
    checkResting("objects/" + object.name + ".txt", sequence.trueObjectPaths()[i], result);
  }
  checkOdometry(sequence, result);
}

}  // namespace diorama
