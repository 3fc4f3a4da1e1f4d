#include "sim/frame_record.h"

#include "core/text.h"

namespace diorama {
namespace {
constexpr size_t kObjectFields = 21;
}

std::string formatRecord(const FrameRecord& record) {
  std::string text = "camera " + std::to_string(record.truth.timestamp_ns) + " " +
                     formatPose(record.truth.T_world_camera, ' ') + "\n";
  for (size_t n = 0; n < record.truth.objects.size(); ++n) {
    const ObjectTruth& object = record.truth.objects[n];
    const ObjectPixels& pixels = record.pixels[n];
    text += "object " + object.name + " " + formatPose(object.T_world_object, ' ');
    for (int number : {object.px_all, object.px_valid, object.px_visible, pixels.with_depth})
      text += " " + std::to_string(number);
    for (const PixelBox& box : {pixels.whole, pixels.visible})
      for (int number : {box.x0, box.y0, box.x1, box.y1}) text += " " + std::to_string(number);
    text += "\n";
  }
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
    } else if (fields[0] == "object" && fields.size() == kObjectFields) {
      ObjectTruth object;
      object.name = fields[1];
      const auto pose = parsePose(fields, 2);
      std::vector<int> numbers;
      for (size_t i = 9; i < kObjectFields; ++i) {
        const auto number = parseInteger(fields[i]);
        if (!number) fail();
        numbers.push_back(static_cast<int>(*number));
      }
      if (!pose) fail();
      object.T_world_object = *pose;
      object.px_all = numbers[0];
      object.px_valid = numbers[1];
      object.px_visible = numbers[2];
      record.truth.objects.push_back(std::move(object));
      record.pixels.push_back({numbers[3],
                               {numbers[4], numbers[5], numbers[6], numbers[7]},
                               {numbers[8], numbers[9], numbers[10], numbers[11]}});
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
