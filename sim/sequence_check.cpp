#include "sim/sequence_check.h"

#include <algorithm>

#include "core/files.h"
#include "sim/mesh_import.h"
#include "sim/sequence_check_state.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

fs::path relativeName(const fs::path& file, const fs::path& folder) {
  return file.lexically_normal().lexically_relative(folder.lexically_normal());
}

}  // namespace

void CheckResult::append(const CheckResult& other) {
  findings.insert(findings.end(), other.findings.begin(), other.findings.end());
  for (size_t i = 0; i < examined.size(); ++i) examined[i] += other.examined[i];
}

// `file:line:column: what` becomes a finding about the file.
void SequenceCheck::State::addError(Check check, std::string line, CheckResult& result) const {
  const std::string home = (folder / "").string();
  if (line.starts_with(home)) line.erase(0, home.size());
  const size_t colon = line.find(':');
  if (colon == std::string::npos)
    result.add(check, "sequence.yaml", line);
  else
    result.add(check, line.substr(0, colon),
               std::string(trim(std::string_view(line).substr(colon + 1))));
}

void SequenceCheck::State::open() {
  if (fs::exists(folder / "manifest.csv"))
    guarded(Check::kFiles, opening, [&] { manifest = readManifest(folder / "manifest.csv"); });
  guarded(Check::kFiles, opening, [&] {
    reader.emplace(folder);
    std::vector<Mesh> meshes;
    for (const SequenceObject& object : reader->objects())
      meshes.push_back(importMesh(object.model, {object.scale, object.y_up}));
    objects.emplace(reader->camera(), meshes);
    depth.emplace(reader->camera());
  });
  if (!depth) reader.reset();
  if (reader) listFlow();
  if (fs::exists(folder / "instances.csv"))
    guarded(Check::kMasks, opening, [&] { instances = readInstances(folder / "instances.csv"); });
  for (const auto& [name, id] : instances) last_id = std::max<int>(last_id, id);
}

std::shared_ptr<const LoadedFrame> SequenceCheck::State::load(int k) const {
  auto frame = std::make_shared<LoadedFrame>();
  std::optional<GroundTruth> truth = reader->readTruth(k);
  if (!truth) return frame;
  frame->view.T_world_camera = truth->T_world_camera;
  frame->view.row_poses = truth->row_poses;
  frame->view.depth_m = std::move(truth->depth_m);
  frame->view.ids = std::move(truth->instance_id);
  frame->has_ids = !frame->view.ids.empty() && !instances.empty();
  if (frame->view.ids.empty())
    frame->view.ids = Image<uint16_t>(reader->camera().width(), reader->camera().height());
  frame->truth = std::move(*truth);
  if (!frame->view.depth_m.empty()) frame->lonely = depth->lonelyPixels(frame->view);
  return frame;
}

// Frames are kept while others may ask for them. One that cannot be read is an empty one to others.
std::shared_ptr<const LoadedFrame> SequenceCheck::State::frame(int k) const {
  constexpr size_t kKept = 2 * kCompany + 16;
  std::promise<std::shared_ptr<const LoadedFrame>> promise;
  std::shared_future<std::shared_ptr<const LoadedFrame>> future;
  bool mine = false;
  {
    const std::lock_guard lock(mutex);
    const auto known = loaded.find(k);
    if (known != loaded.end()) {
      future = known->second;
    } else {
      mine = true;
      future = loaded.emplace(k, promise.get_future().share()).first->second;
      while (loaded.size() > kKept && loaded.begin()->first != k) loaded.erase(loaded.begin());
    }
  }
  if (mine) {
    try {
      promise.set_value(load(k));
    } catch (const Error& error) {
      auto broken = std::make_shared<LoadedFrame>();
      broken->problem = error.what();
      promise.set_value(std::move(broken));
    }
  }
  return future.get();
}

// The nearest first.
std::vector<std::shared_ptr<const LoadedFrame>> SequenceCheck::State::company(int k) const {
  std::vector<std::shared_ptr<const LoadedFrame>> others;
  for (int d = 1; d <= kCompany; ++d)
    for (int other : {k - d, k + d})
      if (other >= 0 && other < reader->frameCount()) {
        others.push_back(frame(other));
        if (others.back()->view.depth_m.empty()) others.pop_back();
      }
  return others;
}

fs::path SequenceCheck::State::depthFile(int k) const {
  for (const ImageEntry& entry : reader->depthImages())
    if (entry.timestamp_ns == reader->timestampNs(k)) return relativeName(entry.file, folder);
  return "depth.txt";
}

std::optional<uint16_t> SequenceCheck::State::idOf(size_t object) const {
  const auto found = instances.find(reader->objects()[object].name);
  return found == instances.end() ? std::nullopt : std::optional(found->second);
}

void SequenceCheck::State::checkSumsOf(int part, CheckResult& result) const {
  if (!manifest) return;
  const size_t parts = reader ? static_cast<size_t>(reader->frameCount()) : 1;
  const auto bound = [&](size_t i) { return manifest->size() * i / parts; };
  const size_t i = static_cast<size_t>(part);
  checkSums(folder, *manifest, bound(i), bound(i + 1), result);
}

SequenceCheck::SequenceCheck(fs::path folder) : state_(std::make_unique<State>(std::move(folder))) {
  std::error_code error;
  if (!fs::is_regular_file(state_->folder / "sequence.yaml", error))
    throw MissingInputError(state_->folder / "sequence.yaml", "expected a sequence folder");
  state_->open();
}
SequenceCheck::~SequenceCheck() = default;

int SequenceCheck::partCount() const {
  return state_->reader ? std::max(1, state_->reader->frameCount()) : 1;
}

CheckResult SequenceCheck::checkPart(int part) const {
  CheckResult result;
  state_->checkSumsOf(part, result);
  if (!state_->reader) return result;
  const size_t problems = result.findings.size();
  state_->checkImages(part, result);
  if (result.findings.size() > problems) return result;  // the rest would only say so again
  const std::shared_ptr<const LoadedFrame> frame = state_->frame(part);
  if (!frame->problem.empty()) {
    state_->addError(Check::kImages, frame->problem, result);
    return result;
  }
  state_->guarded(Check::kMasks, result, [&] { state_->checkMasks(part, *frame, result); });
  state_->checkRows(part, *frame, result);
  const bool has_depth = !frame->view.depth_m.empty();
  if (has_depth && state_->checkPose(part, *frame, result)) return result;
  state_->checkObjects(part, *frame, result);
  if (has_depth) state_->checkDepth(part, *frame, result);
  if (has_depth) state_->checkFlow(part, result);
  if (has_depth) state_->checkNormals(part, *frame, result);
  return result;
}

CheckResult SequenceCheck::checkWhole() const {
  CheckResult result = state_->opening;
  if (!state_->reader) return result;
  const SequenceReader& sequence = *state_->reader;
  checkTimes(sequence, result);
  const auto visibility = state_->folder / "visibility.csv";
  if (fs::exists(visibility))
    state_->guarded(Check::kVisibility, result,
                    [&] { checkVisibilityRows(sequence, visibility, result); });
  state_->guarded(Check::kPoses, result, [&] { checkPaths(sequence, result); });
  return result;
}

}  // namespace diorama
