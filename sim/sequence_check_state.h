// What the parts of a sequence check share. Only for sim/sequence_check*.cpp.
#pragma once

#include <future>
#include <map>
#include <mutex>
#include <optional>

#include "core/errors.h"
#include "core/text.h"
#include "sim/sequence_check.h"
#include "sim/sequence_check_depth.h"
#include "sim/sequence_check_files.h"
#include "sim/sequence_check_objects.h"

namespace diorama {

inline constexpr int kCompany = 8;  // frames before and after a frame that bear witness

struct LoadedFrame {
  GroundTruth truth;  // its depth and ids are in the view
  DepthView view;
  bool has_ids = false;  // else they are all 0
  std::string problem;   // why it cannot be read
  std::vector<Pixel> lonely;
};

inline std::string atPixel(int x, int y) {
  return "at pixel (" + std::to_string(x) + ", " + std::to_string(y) + ")";
}

inline std::string millimetres(double m) { return formatFixed(1e3 * m, 1) + " mm"; }

struct SequenceCheck::State {
  explicit State(std::filesystem::path f) : folder(std::move(f)) {}

  void open();
  std::shared_ptr<const LoadedFrame> frame(int k) const;
  std::shared_ptr<const LoadedFrame> load(int k) const;
  std::vector<std::shared_ptr<const LoadedFrame>> company(int k) const;
  std::filesystem::path depthFile(int k) const;
  std::optional<uint16_t> idOf(size_t object) const;
  void addError(Check check, std::string line, CheckResult& result) const;
  template <class F>
  void guarded(Check check, CheckResult& result, const F& f) const;

  void checkSumsOf(int part, CheckResult& result) const;
  void checkImages(int k, CheckResult& result) const;
  void checkMasks(int k, const LoadedFrame& frame, CheckResult& result) const;
  Image<uint8_t> visibleMask(int k, size_t object) const;
  void checkRows(int k, const LoadedFrame& frame, CheckResult& result) const;
  bool checkPose(int k, const LoadedFrame& frame, CheckResult& result) const;
  bool moves(size_t object) const;
  void checkObjects(int k, const LoadedFrame& frame, CheckResult& result) const;
  void nameDifferences(int k, size_t object, const ObjectTruth& truth,
                       const ObjectDifferences& differences, CheckResult& result) const;
  void checkDepth(int k, const LoadedFrame& frame, CheckResult& result) const;
  std::optional<double> misplaced(const LoadedFrame& frame, Pixel pixel,
                                  const std::vector<std::shared_ptr<const LoadedFrame>>& others,
                                  std::map<std::pair<size_t, uint16_t>, bool>& resting) const;
  bool showsItselfAgain(const LoadedFrame& frame, Pixel pixel, double off_m,
                        const std::vector<std::shared_ptr<const LoadedFrame>>& others) const;

  void listFlow();
  void checkFlow(int k, CheckResult& result) const;
  void checkFlowFile(const std::string& file, int k, int to, CheckResult& result) const;
  double flowError(const Vector2d& found_px, const LoadedFrame& frame, Pixel pixel,
                   const LoadedFrame& other, const SE3& motion) const;
  bool objectsAreOff(int k) const;
  bool mayMove(int id, const LoadedFrame& frame) const;
  void checkNormals(int k, const LoadedFrame& frame, CheckResult& result) const;
  std::optional<SE3> motionOf(uint16_t id, const GroundTruth& from, const GroundTruth& to) const;

  std::filesystem::path folder;
  CheckResult opening;  // what was wrong with the text files
  std::optional<FileSums> manifest;
  std::optional<SequenceReader> reader;
  std::map<std::string, uint16_t> instances;
  std::optional<DepthComparison> depth;
  std::optional<ObjectComparison> objects;
  int last_id = 0;
  std::map<int, int> index_of_number;                    // frames by their numbers in the scene
  std::multimap<int, std::pair<int, std::string>> flow;  // by frame: the other frame, the file

  mutable std::mutex mutex;
  mutable std::map<int, std::shared_future<std::shared_ptr<const LoadedFrame>>> loaded;
};

// What is wrong with a file is a finding about it.
template <class F>
void SequenceCheck::State::guarded(Check check, CheckResult& result, const F& f) const {
  try {
    f();
  } catch (const Error& error) {
    addError(check, error.what(), result);
  }
}

}  // namespace diorama
