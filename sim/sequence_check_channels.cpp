// Channels that only some sequences have: optical flow and normals.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/image_file.h"
#include "sim/sequence_check_state.h"
#include "sim/sequence_names.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr double kFlow_px = 0.05;  // files resolve 1/64 px, depth 0.2 mm
constexpr double kFlowScale = 64, kFlowZero = 32768;
constexpr double kMovingRatio = 0.2;  // more pixels of an instance off: it moves by itself
constexpr double kNormal_rad = 20 * std::numbers::pi / 180;  // 3 x 3 pixels know it no better
constexpr double kUnit = 0.02;                               // of 8 bits
constexpr double kBevels = 0.002;  // of the pixels may show a facet that is smaller than they are

struct Mismatch {
  int pixels = 0, off = 0;
  Pixel first;
};

// `AAAAAA_BBBBBB.png`
std::optional<std::pair<int, int>> flowNumbers(const fs::path& file) {
  const std::string name = file.stem().string();
  if (file.extension() != ".png" || name.size() != 13 || name[6] != '_') return std::nullopt;
  const auto from = parseInteger(name.substr(0, 6)), to = parseInteger(name.substr(7));
  if (!from || !to) return std::nullopt;
  return std::pair(static_cast<int>(*from), static_cast<int>(*to));
}

}  // namespace

void SequenceCheck::State::listFlow() {
  for (int k = 0; k < reader->frameCount(); ++k) index_of_number[reader->frameNumber(k)] = k;
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder / "flow", error)) {
    const auto numbers = flowNumbers(entry.path());
    if (!numbers) continue;
    const std::string file = "flow/" + entry.path().filename().string();
    const auto from = index_of_number.find(numbers->first),
               to = index_of_number.find(numbers->second);
    if (from == index_of_number.end() || to == index_of_number.end())
      opening.add(Check::kFlow, file, "is between frames that are not there");
    else
      flow.emplace(from->second, std::pair(to->second, file));
  }
}

void SequenceCheck::State::checkFlow(int k, const LoadedFrame& frame, CheckResult& result) const {
  const auto [first, last] = flow.equal_range(k);
  for (auto it = first; it != last; ++it) {
    const auto& [to, file] = it->second;
    guarded(Check::kFlow, result, [&, &name = file, other = this->frame(to)] {
      checkFlowFile(name, frame, *other, result);
    });
  }
}

// How a tracked object has moved in the world; all else rests.
SE3 SequenceCheck::State::motionOf(uint16_t id, const GroundTruth& from,
                                   const GroundTruth& to) const {
  for (size_t n = 0; n < reader->objects().size(); ++n) {
    if (idOf(n) != id) continue;
    for (const ObjectTruth& a : from.objects)
      for (const ObjectTruth& b : to.objects)
        if (a.name == reader->objects()[n].name && b.name == a.name)
          return b.T_world_object * a.T_world_object.inverse();
  }
  return {};
}

void SequenceCheck::State::checkFlowFile(const std::string& file, const LoadedFrame& frame,
                                         const LoadedFrame& other, CheckResult& result) const {
  const int width = reader->camera().width(), height = reader->camera().height();
  const Image<Rgb16> image = readWideColor(folder / file, width, height);
  if (other.view.depth_m.empty()) return;
  std::vector<SE3> motions;
  for (int id = 0; id <= last_id; ++id)
    motions.push_back(motionOf(static_cast<uint16_t>(id), frame.truth, other.truth));
  std::vector<Mismatch> mismatches(motions.size());
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      const Rgb16& pixel = image(x, y);
      const uint16_t id = frame.view.ids(x, y);
      if (pixel.b == 0 || id > last_id || !(frame.view.depth_m(x, y) > 0)) continue;
      Mismatch& mismatch = mismatches[id];
      ++mismatch.pixels;
      const auto expected = depth->carry(frame.view, {x, y}, other.view, motions[id]);
      const Vector2d found(x + (pixel.r - kFlowZero) / kFlowScale,
                           y + (pixel.g - kFlowZero) / kFlowScale);
      if (expected && (*expected - found).cwiseAbs().maxCoeff() < kFlow_px) continue;
      // At the very border the point may lie half outside the image.
      if (!expected && !reader->camera().contains(found, 1)) continue;
      if (mismatch.off++ == 0) mismatch.first = {x, y};
    }
  for (int id = 0; id <= last_id; ++id) {
    const Mismatch& m = mismatches[static_cast<size_t>(id)];
    result.count(Check::kFlow, m.pixels);
    const bool moves_by_itself = id > 0 && m.off > kMovingRatio * m.pixels;
    if (m.off > 0 && !moves_by_itself)
      result.add(Check::kFlow, file,
                 "is not what depth and poses make of it " + atPixel(m.first.x, m.first.y) +
                     " and at " + std::to_string(m.off - 1) + " more");
  }
}

void SequenceCheck::State::checkNormals(int k, const LoadedFrame& frame,
                                        CheckResult& result) const {
  const std::string file = frameFile("normal", reader->frameNumber(k));
  if (!fs::exists(folder / file)) return;
  guarded(Check::kNormals, result, [&] {
    const int width = reader->camera().width(), height = reader->camera().height();
    const AnyImage read = readImage(folder / file, width, height);
    const auto* image = std::get_if<Image<Rgb8>>(&read);
    if (!image) throw InputError(folder / file, "is no colour image");
    Mismatch wrong, tilted;  // no unit vector towards the camera; not along the depth's plane
    const auto note = [](Mismatch& mismatch, int x, int y) {
      if (mismatch.off++ == 0) mismatch.first = {x, y};
    };
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const Rgb8 pixel = (*image)(x, y);
        if (pixel == Rgb8{}) continue;
        const Vector3d n = Vector3d(pixel.r, pixel.g, pixel.b) * (2 / 255.0) - Vector3d::Ones();
        ++wrong.pixels;
        if (std::abs(n.norm() - 1) > kUnit || n.dot(depth->ray(x, y).normalized()) > kUnit)
          note(wrong, x, y);
        const auto expected = depth->normal(frame.view, {x, y});
        if (!expected) continue;
        ++tilted.pixels;
        if (n.normalized().dot(*expected) < std::cos(kNormal_rad)) note(tilted, x, y);
      }
    result.count(Check::kNormals, wrong.pixels);
    if (wrong.off > 0)
      result.add(Check::kNormals, file,
                 "is no unit vector towards the camera " + atPixel(wrong.first.x, wrong.first.y) +
                     " and at " + std::to_string(wrong.off - 1) + " more");
    if (tilted.off > kBevels * tilted.pixels)
      result.add(Check::kNormals, file,
                 "is not along the depth's planes " + atPixel(tilted.first.x, tilted.first.y) +
                     " and at " + std::to_string(tilted.off - 1) + " more");
  });
}

}  // namespace diorama
