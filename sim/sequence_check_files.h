// The parts of a sequence check that need no pixels.
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "sim/sequence_check.h"

namespace diorama {

using FileSums = std::vector<std::pair<std::string, std::string>>;  // relative name, SHA-256

// manifest.csv; throws InputError with the line.
FileSums readManifest(const std::filesystem::path& file);

// Whether these files are there with these sums; a range of the list.
void checkSums(const std::filesystem::path& folder, const FileSums& sums, size_t first, size_t end,
               CheckResult& result);

// instances.csv: ids by object name. Throws InputError with the line.
std::map<std::string, uint16_t> readInstances(const std::filesystem::path& file);

// Whether visibility.csv has a row for each object of each frame, with the fraction that its counts
// make.
void checkVisibilityRows(const SequenceReader& sequence, const std::filesystem::path& file,
                         CheckResult& result);

// Whether all files that belong to the frames have the frames' times. A trajectory that was
// recorded by another clock (less than half of the times are in it) must only increase.
void checkTimes(const SequenceReader& sequence, CheckResult& result);

// Whether an object that rests (the same pose, to the last digit, before and after) has another
// pose in between, and whether the camera moves as the record of the simulated odometry has it, to
// within its noise.
void checkPaths(const SequenceReader& sequence, CheckResult& result);

}  // namespace diorama
