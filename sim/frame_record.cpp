#include "sim/frame_record.h"

#include "core/text.h"

namespace diorama {

std::string formatRecord(const FrameRecord& record) {
  std::string text = "camera " + std::to_string(record.truth.timestamp_ns) + " " +
                     formatPose(record.truth.T_world_camera, ' ') + "\n";
  for (const ObjectTruth& object : record.truth.objects)
    text += "object " + object.name + " " + formatPose(object.T_world_object, ' ') + " " +
            std::to_string(object.px_all) + " " + std::to_string(object.px_valid) + " " +
            std::to_string(object.px_visible) + "\n";
  for (const auto& [name, hash] : record.files) text += "file " + name + " " + hash + "\n";
  return text + "end\n";
}

FrameRecord parseRecord(const std::string& text, const std::filesystem::path& file) {
  FrameRecord record;
  int number = 0;
  bool complete = false;
  const auto fail = [&] {
    throw InputError(SourcePlace{file.string(), number}, "is no frame record",
                     "delete the folder it is in and render again");
  };
  for (std::string_view line : split(text, '\n')) {
    ++number;
    const std::vector<std::string_view> fields = splitBlanks(line);
    if (fields.empty()) continue;
    if (fields[0] == "camera" && fields.size() == 9) {
      const auto time = parseInteger(fields[1]);
      const auto pose = parsePose(fields, 2);
      if (!time || !pose) fail();
      record.truth.timestamp_ns = *time;
      record.truth.T_world_camera = *pose;
    } else if (fields[0] == "object" && fields.size() == 12) {
      ObjectTruth object;
      object.name = fields[1];
      const auto pose = parsePose(fields, 2);
      const auto all = parseInteger(fields[9]), valid = parseInteger(fields[10]),
                 visible = parseInteger(fields[11]);
      if (!pose || !all || !valid || !visible) fail();
      object.T_world_object = *pose;
      object.px_all = static_cast<int>(*all);
      object.px_valid = static_cast<int>(*valid);
      object.px_visible = static_cast<int>(*visible);
      record.truth.objects.push_back(std::move(object));
    } else if (fields[0] == "file" && fields.size() == 3) {
      record.files.emplace_back(fields[1], fields[2]);
    } else if (fields[0] == "end" && fields.size() == 1) {
      complete = true;
    } else {
      fail();
    }
  }
  if (!complete) fail();
  return record;
}

}  // namespace diorama
