#include "app/overlay.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "core/text.h"
#include "tracker/edge_model.h"

namespace diorama {
namespace {

const cv::Scalar kTruthColor(235, 60, 215);  // RGB
const cv::Scalar kObjectColors[] =
    {  // held by the tracker; as in the report (eval/report/report.css)
        {75, 240, 105},
        {79, 198, 240},
        {179, 156, 255},
        {237, 163, 94},
        {195, 210, 74}};
const cv::Scalar kPredictedColor(255, 190, 40);  // the tracker does not hold the object
const cv::Scalar kTextColor(245, 245, 245);
constexpr double kPieceLength_px = 6;
constexpr int kShift = 4;  // fractional bits of drawn coordinates

struct Piece {
  Vector2d a_px, b_px;
};

cv::Point subpixel(const Vector2d& u) {
  return {static_cast<int>(std::lround(u.x() * (1 << kShift))),
          static_cast<int>(std::lround(u.y() * (1 << kShift)))};
}

void drawPieces(cv::Mat& picture, const std::vector<Piece>& pieces, const cv::Scalar& color,
                int thickness) {
  for (const Piece& piece : pieces)
    cv::line(picture, subpixel(piece.a_px), subpixel(piece.b_px), color, thickness, cv::LINE_AA,
             kShift);
}

double textWidth(const std::string& text) {
  int baseline = 0;
  return cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, 0.42, 1, &baseline).width;
}

void drawText(cv::Mat& picture, const std::string& text, int x, int y, const cv::Scalar& color) {
  cv::putText(picture, text, {x, y}, cv::FONT_HERSHEY_SIMPLEX, 0.42, color, 1, cv::LINE_AA);
}

std::string objectLine(const std::string& name, const OverlayObject& object) {
  std::string line = name + ":  ";
  line += !object.T_camera_object ? "no estimate" : object.claimed ? "held" : "carried";
  if (object.health) line += "   health " + formatFixed(*object.health, 2);
  if (object.T_camera_object && object.T_camera_object_true) {
    const SE3 error = object.T_camera_object_true->inverse() * *object.T_camera_object;
    line += "   error " +
            formatFixed(1e3 * (object.T_camera_object->translation -
                               object.T_camera_object_true->translation)
                                  .norm(),
                        1) +
            " mm, " + formatFixed(logSO3(error.rotation).norm() * 180 / M_PI, 2) + " deg";
  }
  if (object.visible_fraction)
    line += "   visible " + formatFixed(100 * *object.visible_fraction, 0) + "%";
  return line;
}

}  // namespace

struct OverlayPainter::Impl {
  Camera camera;
  std::vector<std::string> names;
  std::vector<EdgeModel> edges;
  std::shared_ptr<const RayQuery> rays;

  // The pieces of the object's edges that are not hidden by the object itself.
  std::vector<Piece> visiblePieces(size_t object, const SE3& T_camera_object) const {
    const EdgeModel& model = edges[object];
    const Vector3d camera_in_object = T_camera_object.inverse().translation;
    const Vector3d camera_in_model = camera_in_object - model.centre_object;
    std::vector<Piece> pieces;
    std::vector<Vector3d> middles;
    for (const ModelEdge& edge : model.edges) {
      const Vector3d &a = model.vertices[static_cast<size_t>(edge.a)],
                     &b = model.vertices[static_cast<size_t>(edge.b)];
      const Vector3d view = a - camera_in_model;
      if (edge.kind == EdgeKind::kSmooth && edge.n1.dot(view) * edge.n2.dot(view) > 0) continue;
      const auto at = [&](double s) { return Vector3d(a + s * (b - a) + model.centre_object); };
      const auto ua = camera.project(T_camera_object * at(0)),
                 ub = camera.project(T_camera_object * at(1));
      if (!ua || !ub) continue;
      const int n = std::clamp(static_cast<int>((*ub - *ua).norm() / kPieceLength_px), 1, 200);
      for (int k = 0; k < n; ++k) {
        const auto u = camera.project(T_camera_object * at(double(k) / n));
        const auto v = camera.project(T_camera_object * at(double(k + 1) / n));
        if (!u || !v || (!camera.contains(*u) && !camera.contains(*v))) continue;
        pieces.push_back({*u, *v});
        middles.push_back(at((k + 0.5) / n));
      }
    }
    std::vector<uint8_t> hidden(middles.size());
    rays->occluded(static_cast<int>(object), camera_in_object, middles, hidden);
    size_t kept = 0;
    for (size_t i = 0; i < pieces.size(); ++i)
      if (!hidden[i]) pieces[kept++] = pieces[i];
    pieces.resize(kept);
    return pieces;
  }

  void drawPanel(cv::Mat& picture, const std::string& title,
                 const std::vector<OverlayObject>& objects) const {
    const int line_height = 17;
    const int height = line_height * (1 + static_cast<int>(objects.size())) + 6;
    cv::Mat panel = picture.rowRange(std::max(0, picture.rows - height), picture.rows);
    panel.convertTo(panel, -1, 0.35);
    int y = picture.rows - height + line_height - 2;
    drawText(picture, title, 8, y, kTextColor);
    int right = picture.cols - 8;
    const auto drawKey = [&](const std::string& name, const cv::Scalar& color) {
      right -= static_cast<int>(textWidth(name));
      drawText(picture, name, right, y, color);
      right -= 14;
    };
    if (std::any_of(objects.begin(), objects.end(),
                    [](const OverlayObject& object) { return object.T_camera_object_true; }))
      drawKey("truth", kTruthColor);
    drawKey("estimate", kObjectColors[0]);
    for (size_t i = 0; i < objects.size(); ++i) {
      y += line_height;
      drawText(picture, objectLine(names[i], objects[i]), 8, y,
               !objects[i].claimed  ? kPredictedColor
               : objects.size() > 1 ? kObjectColors[i % std::size(kObjectColors)]
                                    : kTextColor);
    }
  }
};

OverlayPainter::OverlayPainter(Camera camera, const std::vector<ObjectModel>& models,
                               std::shared_ptr<const RayQuery> rays)
    : impl_(std::make_unique<Impl>()) {
  impl_->camera = std::move(camera);
  impl_->rays = std::move(rays);
  for (const ObjectModel& model : models) {
    impl_->names.push_back(model.name);
    impl_->edges.push_back(makeEdgeModel(model.mesh, {}));
  }
}

OverlayPainter::~OverlayPainter() = default;

Image<Rgb8> OverlayPainter::paint(const Frame& frame, const std::string& title,
                                  const std::vector<OverlayObject>& objects) const {
  Image<Rgb8> out = frame.rgb;
  if (out.empty()) {
    out = Image<Rgb8>(frame.gray.width, frame.gray.height);
    for (size_t i = 0; i < out.pixels.size(); ++i)
      out.pixels[i] = {frame.gray.pixels[i], frame.gray.pixels[i], frame.gray.pixels[i]};
  }
  cv::Mat picture(out.height, out.width, CV_8UC3, out.pixels.data());
  for (size_t i = 0; i < objects.size(); ++i) {
    const OverlayObject& object = objects[i];
    if (object.T_camera_object_true)
      drawPieces(picture, impl_->visiblePieces(i, *object.T_camera_object_true), kTruthColor, 2);
    if (object.T_camera_object)
      drawPieces(picture, impl_->visiblePieces(i, *object.T_camera_object),
                 object.claimed ? kObjectColors[i % std::size(kObjectColors)] : kPredictedColor, 1);
  }
  impl_->drawPanel(picture, title, objects);
  return out;
}

}  // namespace diorama
