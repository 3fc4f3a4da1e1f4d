#include "sim/truth_files.h"

#include <array>
#include <cmath>

#include "core/files.h"
#include "core/sha256.h"
#include "core/text.h"
#include "sim/png_encoder.h"
#include "sim/sequence_names.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

struct Table {
  const char* name;
  const char* header;
};
constexpr std::array kTables = {
    Table{"edges.csv", "frame,object,edge_id,kind,part,u,v\n"},
    Table{"row_poses.csv", "frame,row,timestamp,tx,ty,tz,qx,qy,qz,qw\n"},
};

std::string partOf(const char* table, int frame, const std::string& parts) {
  return parts + "/" + sixDigits(static_cast<size_t>(frame)) + "_" + table;
}

uint8_t toByte(float part) { return static_cast<uint8_t>(std::lround((part + 1) / 2 * 255)); }

// Rows follow each other by less than a microsecond: nanoseconds.
std::string rowPoseLines(int frame, const GroundTruth& truth, const Scene& scene) {
  std::string lines;
  for (size_t y = 0; y < truth.row_poses.size(); ++y)
    lines += std::to_string(frame) + "," + std::to_string(y) + "," +
             formatFixed(scene.time_s(frame) + scene.rowOffset_s(static_cast<int>(y)), 9) + "," +
             formatPose(truth.row_poses[y], ',') + "\n";
  return lines;
}

// A row for each vertex; those of one part follow one another.
std::string edgeLines(int frame, const GroundTruth& truth) {
  constexpr std::array kKinds = {"boundary", "sharp", "silhouette"};  // in the order of EdgeKind
  std::string lines;
  for (size_t part = 0; part < truth.edges->size(); ++part) {
    const VisibleEdge& edge = (*truth.edges)[part];
    const std::string start = std::to_string(frame) + "," +
                              truth.objects[static_cast<size_t>(edge.object)].name + "," +
                              std::to_string(edge.edge) + "," +
                              kKinds[static_cast<size_t>(edge.kind)] + "," + std::to_string(part);
    for (const Vector2d& u : edge.line_px)
      lines += start + "," + formatFixed(u.x(), 3) + "," + formatFixed(u.y(), 3) + "\n";
  }
  return lines;
}

}  // namespace

Image<Rgb8> toPicture(const Image<Normal>& normal) {
  Image<Rgb8> picture(normal.width, normal.height);
  for (size_t i = 0; i < normal.pixels.size(); ++i)
    if (const Normal& n = normal.pixels[i]; n != Normal{})
      picture.pixels[i] = {toByte(n.x), toByte(n.y), toByte(n.z)};
  return picture;
}

Image<Rgb16> toPicture(const FlowField& flow) {
  Image<Rgb16> picture(flow.flow_px.width, flow.flow_px.height);
  for (size_t i = 0; i < picture.pixels.size(); ++i) {
    const FlowState state = flow.state.pixels[i];
    if (state == FlowState::kNoSurface) continue;
    const float u = std::round(kFlowScale * flow.flow_px.pixels[i].u + kFlowZero),
                v = std::round(kFlowScale * flow.flow_px.pixels[i].v + kFlowZero);
    if (u < 1 || v < 1 || u > 65535 || v > 65535) continue;
    picture.pixels[i] = {static_cast<uint16_t>(u), static_cast<uint16_t>(v),
                         static_cast<uint16_t>(state == FlowState::kVisible)};
  }
  return picture;
}

std::vector<NamedFile> truthFiles(int frame, const GroundTruth& truth, const Scene& scene,
                                  const std::string& parts) {
  std::vector<NamedFile> files;
  if (!truth.normal.empty())
    files.push_back({frameFile("normal", frame), encodePng(toPicture(truth.normal))});
  if (truth.flow) {
    const std::string name = "flow/" + sixDigits(static_cast<size_t>(truth.flow->from)) + "_" +
                             sixDigits(static_cast<size_t>(truth.flow->to));
    Image<uint8_t> state(truth.flow->state.width, truth.flow->state.height);
    for (size_t i = 0; i < state.pixels.size(); ++i)
      state.pixels[i] = static_cast<uint8_t>(truth.flow->state.pixels[i]);
    files.push_back({name + ".png", encodePng(toPicture(*truth.flow))});
    files.push_back({name + "_state.png", encodePng(state, PngContent::kLabels)});
  }
  if (truth.edges) files.push_back({partOf("edges.csv", frame, parts), edgeLines(frame, truth)});
  if (!truth.row_poses.empty())
    files.push_back({partOf("row_poses.csv", frame, parts), rowPoseLines(frame, truth, scene)});
  return files;
}

std::vector<HashedFile> joinTables(const fs::path& folder, const std::string& parts, int first,
                                   int end) {
  std::vector<HashedFile> tables;
  for (const Table& table : kTables) {
    std::error_code error;
    if (!fs::exists(folder / partOf(table.name, first, parts), error)) continue;
    AtomicFile out(folder / table.name);
    Sha256 hash;
    const auto write = [&](const std::string& text) {
      out.write(text);
      hash.update(text);
    };
    write(table.header);
    for (int k = first; k < end; ++k) write(readFile(folder / partOf(table.name, k, parts)));
    out.commit();
    tables.push_back({table.name, hash.hexDigest()});
  }
  return tables;
}

std::string exposureTable(const Scene& scene, int first, int end) {
  std::string text = "frame,open,mid,close\n";
  for (int k = first; k < end; ++k)
    text += std::to_string(k) + "," + formatSeconds(scene.timestampNs(k) - scene.halfExposureNs()) +
            "," + formatSeconds(scene.timestampNs(k)) + "," +
            formatSeconds(scene.timestampNs(k) + scene.halfExposureNs()) + "\n";
  return text;
}

}  // namespace diorama
