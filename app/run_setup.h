// What `diorama run` was asked for, and the estimators that follow from it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "app/pipeline_types.h"
#include "app/run_input.h"
#include "app/run_options.h"
#include "core/object_detector.h"
#include "core/odometry.h"
#include "core/ray_query.h"

namespace diorama {

struct RunArguments {
  std::string input, output, method = "fused", initial = "given", odometry = "vo", tracker = "edge";
  std::string quality = "standard", frames, options, objects;
  std::vector<std::string> sets, expects;
  std::optional<uint64_t> seed;
  int every = 1;
  bool realtime = false, no_video = false, no_report = false;
};

// Throws UsageError.
Method parseMethod(const std::string& name);
void checkSupported(const RunArguments& arguments);

// The odometry, and one tracker for each object, with its initial pose where that is asked for.
// Throw InputError when the input lacks what they need.
// `rays` counts the objects as the input does.
std::unique_ptr<Odometry> makeOdometry(const RunArguments& arguments, const RunInput& input,
                                       const RunOptions& options,
                                       const std::shared_ptr<const RayQuery>& rays);
std::vector<PipelineObject> makeObjects(const RunArguments& arguments, const RunInput& input,
                                        int first_frame, const RunOptions& options,
                                        const std::shared_ptr<const RayQuery>& rays);

// The mapper's, as they are beside the chosen odometry.
MapperOptions mapperOptions(const RunArguments& arguments, const RunOptions& options);

// For `--initial detect`, otherwise nothing: the databases of the sequence, or made here from the
// meshes. Throws InputError for a database that cannot be used.
std::unique_ptr<ObjectDetector> makeDetector(const RunArguments& arguments, const RunInput& input,
                                             const RunOptions& options,
                                             const std::shared_ptr<const RayQuery>& rays);

// The commit that this program was built from.
std::string programCommit();

// Everything that decides the results, as YAML: the content of run.yaml.
std::string recipe(const RunArguments& arguments, const RunInput& input,
                   const std::vector<int>& frames, const RunOptions& options);

}  // namespace diorama
