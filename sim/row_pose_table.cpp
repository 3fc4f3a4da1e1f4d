#include "sim/row_pose_table.h"

#include "core/errors.h"
#include "core/files.h"
#include "core/text.h"

namespace diorama {

RowPoseTable::RowPoseTable(const std::filesystem::path& file)
    : file_(file.string()), content_(readFile(file)) {
  int line = 0, last = -1;
  for (size_t at = 0; at < content_.size();) {
    ++line;
    const size_t end = std::min(content_.find('\n', at), content_.size());
    const std::string_view text(content_.data() + at, end - at);
    const auto frame = parseInteger(text.substr(0, text.find(',')));
    if (frame && *frame >= 0 && *frame <= 999'999 && *frame != last) {
      last = static_cast<int>(*frame);
      frames_.try_emplace(last, Place{at, line});
    }
    at = end + 1;
  }
}

std::vector<SE3> RowPoseTable::rowsOf(int frame, int height) const {
  const auto found = frames_.find(frame);
  if (found == frames_.end()) return {};
  std::vector<SE3> rows;
  auto [at, line] = found->second;
  for (int row = 0; row < height; ++row, ++line) {
    const size_t end = std::min(content_.find('\n', at), content_.size());
    const std::vector<std::string_view> fields =
        split(std::string_view(content_).substr(std::min(at, content_.size()), end - at), ',');
    const SourcePlace place{file_, line};
    if (fields.size() != 10 || parseInteger(fields[0]) != frame || parseInteger(fields[1]) != row)
      throw InputError(
          place, "expected row " + std::to_string(row) + " of frame " + std::to_string(frame));
    const auto pose = parsePose(fields, 3);
    if (!pose) throw InputError(place, "the pose is not finite or its quaternion is zero");
    rows.push_back(*pose);
    at = end + 1;
  }
  return rows;
}

}  // namespace diorama
