#include "sim/triangle_raster.h"

#define GL_GLEXT_PROTOTYPES  // for the functions' types
#include <GL/osmesa.h>

#include <Eigen/Geometry>
#include <array>
#include <mutex>
#include <string>

#include "core/errors.h"

namespace diorama {
namespace {

constexpr double kNear_m = 1e-3;

// Functions come from OSMesa itself: where a process also holds libGL, names would be ambiguous.
struct Gl {
#define DIORAMA_GL_FUNCTIONS(F)                                                                  \
  F(AttachShader)                                                                                \
  F(BindBuffer)                                                                                  \
  F(BindFramebuffer)                                                                             \
  F(BindRenderbuffer)                                                                            \
  F(BindVertexArray)                                                                             \
  F(BufferData) F(CheckFramebufferStatus) F(ClearBufferfv) F(ClearBufferuiv) F(ClipControl)      \
      F(CompileShader) F(CreateProgram) F(CreateShader) F(DepthFunc) F(DrawElements) F(Enable)   \
          F(EnableVertexAttribArray) F(FramebufferRenderbuffer) F(GenBuffers) F(GenFramebuffers) \
              F(GenRenderbuffers) F(GenVertexArrays) F(GetError) F(GetProgramiv)                 \
                  F(GetUniformLocation) F(LinkProgram) F(ReadPixels) F(RenderbufferStorage)      \
                      F(ShaderSource) F(Uniform1ui) F(UniformMatrix4fv) F(UseProgram)            \
                          F(VertexAttribPointer) F(Viewport)
#define DIORAMA_GL_MEMBER(name) decltype(&gl##name) name = nullptr;
  DIORAMA_GL_FUNCTIONS(DIORAMA_GL_MEMBER)

  void load() {
#define DIORAMA_GL_LOAD(name)                                                \
  name = reinterpret_cast<decltype(name)>(OSMesaGetProcAddress("gl" #name)); \
  if (name == nullptr) throw Error(kExitInternal, "OSMesa has no gl" #name);
    DIORAMA_GL_FUNCTIONS(DIORAMA_GL_LOAD)
  }
};

// OSMesa keeps lists of its own: contexts are made, bound and destroyed by one thread at a time.
std::mutex& osmesaMutex() {
  static std::mutex mutex;
  return mutex;
}

class Context {
 public:
  Context() {
    static constexpr std::array<int, 13> kAttributes = {OSMESA_FORMAT,
                                                        OSMESA_RGBA,
                                                        OSMESA_DEPTH_BITS,
                                                        0,
                                                        OSMESA_STENCIL_BITS,
                                                        0,
                                                        OSMESA_PROFILE,
                                                        OSMESA_CORE_PROFILE,
                                                        OSMESA_CONTEXT_MAJOR_VERSION,
                                                        4,
                                                        OSMESA_CONTEXT_MINOR_VERSION,
                                                        5,
                                                        0};
    const std::lock_guard lock(osmesaMutex());
    context_ = OSMesaCreateContextAttribs(kAttributes.data(), nullptr);
    if (context_ == nullptr)
      throw Error(kExitInternal, "OSMesa gives no OpenGL 4.5 core context: use the ray renderer");
  }
  ~Context() {
    const std::lock_guard lock(osmesaMutex());
    OSMesaDestroyContext(context_);
  }
  Context(const Context&) = delete;
  Context& operator=(const Context&) = delete;

  void bind() {
    const std::lock_guard lock(osmesaMutex());
    DIORAMA_CHECK(OSMesaMakeCurrent(context_, window_.data(), GL_UNSIGNED_BYTE, 1, 1));
  }
  static void unbind() {
    const std::lock_guard lock(osmesaMutex());
    OSMesaMakeCurrent(nullptr, nullptr, 0, 0, 0);
  }

 private:
  OSMesaContext context_ = nullptr;
  std::array<uint8_t, 4> window_{};  // what a context insists on drawing to
};

// The context belongs to the calling thread during its life.
class Current {
 public:
  explicit Current(Context& context) { context.bind(); }
  ~Current() { Context::unbind(); }
  Current(const Current&) = delete;
  Current& operator=(const Current&) = delete;
};

constexpr const char* kVertexShader = R"(#version 450 core
layout(location = 0) in vec3 position;
uniform mat4 clip_from_layer;
void main() { gl_Position = clip_from_layer * vec4(position, 1); }
)";

constexpr const char* kFragmentShader = R"(#version 450 core
uniform uint first_id;
layout(location = 0) out uint id;
void main() { id = first_id + uint(gl_PrimitiveID); }
)";

// Depth is near / z, from 1 down to 0 at infinity: floats resolve it alike at all distances, and
// there is no far plane.
Eigen::Matrix4d clipFromView(const PinholeView& view) {
  Eigen::Matrix4d clip = Eigen::Matrix4d::Zero();
  clip(0, 0) = 2 * view.fx / view.width;
  clip(0, 2) = (2 * view.cx + 1) / view.width - 1;
  clip(1, 1) = 2 * view.fy / view.height;
  clip(1, 2) = (2 * view.cy + 1) / view.height - 1;
  clip(2, 3) = kNear_m;
  clip(3, 2) = 1;
  return clip;
}

// Triangles that are drawn together, or not at all when their box is outside the view.
struct Part {
  GLuint vertex_array;
  size_t layer;
  uint32_t first_triangle, triangle_count;
  uint32_t first_id;
  Eigen::AlignedBox3f box;  // in the layer's frame
};

bool isOutside(const Eigen::AlignedBox3f& box, const Eigen::Matrix4d& clip_from_layer) {
  unsigned beyond = 31;
  for (int k = 0; k < 8; ++k) {
    const Vector3f corner = box.corner(static_cast<Eigen::AlignedBox3f::CornerType>(k));
    const Eigen::Vector4d p = clip_from_layer * corner.cast<double>().homogeneous();
    beyond &= unsigned{p.x() < -p.w()} | unsigned{p.x() > p.w()} << 1 |
              unsigned{p.y() < -p.w()} << 2 | unsigned{p.y() > p.w()} << 3 |
              unsigned{p.w() < kNear_m} << 4;
  }
  return beyond != 0;
}

}  // namespace

struct TriangleRaster::State {
  State(std::span<const RenderScene* const> layers, int width, int height) {
    const Current current(context);
    gl.load();
    makeProgram();
    for (size_t k = 0; k < layers.size(); ++k) addLayer(k, *layers[k]);
    makeTarget(width, height);
    gl.Enable(GL_DEPTH_TEST);
    gl.DepthFunc(GL_GREATER);
    gl.ClipControl(GL_LOWER_LEFT, GL_ZERO_TO_ONE);
    DIORAMA_CHECK(gl.GetError() == GL_NO_ERROR);
  }

  void makeProgram() {
    const GLuint program = gl.CreateProgram();
    const auto attach = [&](GLenum kind, const char* text) {
      const GLuint shader = gl.CreateShader(kind);
      gl.ShaderSource(shader, 1, &text, nullptr);
      gl.CompileShader(shader);
      gl.AttachShader(program, shader);
    };
    attach(GL_VERTEX_SHADER, kVertexShader);
    attach(GL_FRAGMENT_SHADER, kFragmentShader);
    gl.LinkProgram(program);
    GLint linked = 0;
    gl.GetProgramiv(program, GL_LINK_STATUS, &linked);
    DIORAMA_CHECK(linked == GL_TRUE);
    gl.UseProgram(program);
    clip_from_layer = gl.GetUniformLocation(program, "clip_from_layer");
    first_id = gl.GetUniformLocation(program, "first_id");
  }

  void addLayer(size_t layer, const RenderScene& scene) {
    GLuint array = 0, buffers[2] = {};
    gl.GenVertexArrays(1, &array);
    gl.BindVertexArray(array);
    gl.GenBuffers(2, buffers);
    const auto upload = [&](GLenum target, GLuint buffer, const auto& values) {
      gl.BindBuffer(target, buffer);
      gl.BufferData(target, static_cast<GLsizeiptr>(values.size() * sizeof(values[0])),
                    values.data(), GL_STATIC_DRAW);
    };
    upload(GL_ARRAY_BUFFER, buffers[0], scene.corners);
    upload(GL_ELEMENT_ARRAY_BUFFER, buffers[1], scene.indices);
    gl.VertexAttribPointer(0, 3, GL_FLOAT, GL_FALSE, sizeof(Vector3f), nullptr);
    gl.EnableVertexAttribArray(0);
    addParts(layer, array, scene);
  }

  // Objects follow one another in the list of triangles.
  void addParts(size_t layer, GLuint array, const RenderScene& scene) {
    const auto count = static_cast<uint32_t>(scene.triangles.size());
    uint32_t end = 0;
    for (uint32_t first = 0; first < count; first = end) {
      Part part{array, layer, first, 0, next_id + first, {}};
      while (end < count && scene.triangles[end].instance == scene.triangles[first].instance) {
        for (int k = 0; k < 3; ++k) part.box.extend(scene.corner(end, k));
        ++end;
      }
      part.triangle_count = end - first;
      parts.push_back(part);
    }
    next_id += count;
  }

  void makeTarget(int width, int height) {
    GLuint frame = 0, targets[2] = {};
    gl.GenFramebuffers(1, &frame);
    gl.BindFramebuffer(GL_FRAMEBUFFER, frame);
    gl.GenRenderbuffers(2, targets);
    const auto attach = [&](GLuint target, GLenum format, GLenum place) {
      gl.BindRenderbuffer(GL_RENDERBUFFER, target);
      gl.RenderbufferStorage(GL_RENDERBUFFER, format, width, height);
      gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, place, GL_RENDERBUFFER, target);
    };
    attach(targets[0], GL_R32UI, GL_COLOR_ATTACHMENT0);
    attach(targets[1], GL_DEPTH_COMPONENT32F, GL_DEPTH_ATTACHMENT);
    DIORAMA_CHECK(gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE);
  }

  Context context;
  Gl gl;
  std::vector<Part> parts;
  uint32_t next_id = 1;
  GLint clip_from_layer = 0, first_id = 0;
};

TriangleRaster::TriangleRaster(std::span<const RenderScene* const> layers, int most_width,
                               int most_height)
    : state_(std::make_unique<State>(layers, most_width, most_height)) {}
TriangleRaster::~TriangleRaster() = default;

void TriangleRaster::draw(const PinholeView& view, std::span<const SE3> T_view_layer,
                          std::vector<uint32_t>& ids) {
  State& s = *state_;
  const Gl& gl = s.gl;
  const Current current(s.context);
  gl.Viewport(0, 0, view.width, view.height);
  const std::array<GLuint, 4> nothing{};
  const float farthest = 0;
  gl.ClearBufferuiv(GL_COLOR, 0, nothing.data());
  gl.ClearBufferfv(GL_DEPTH, 0, &farthest);
  const Eigen::Matrix4d clip_from_view = clipFromView(view);
  for (const Part& part : s.parts) {
    const Eigen::Matrix4d clip = clip_from_view * T_view_layer[part.layer].matrix();
    if (isOutside(part.box, clip)) continue;
    gl.BindVertexArray(part.vertex_array);
    gl.UniformMatrix4fv(s.clip_from_layer, 1, GL_FALSE, Eigen::Matrix4f(clip.cast<float>()).data());
    gl.Uniform1ui(s.first_id, part.first_id);
    const size_t offset = sizeof(uint32_t) * 3 * part.first_triangle;
    gl.DrawElements(GL_TRIANGLES, static_cast<GLsizei>(3 * part.triangle_count), GL_UNSIGNED_INT,
                    reinterpret_cast<const void*>(offset));
  }
  ids.resize(static_cast<size_t>(view.width) * static_cast<size_t>(view.height));
  gl.ReadPixels(0, 0, view.width, view.height, GL_RED_INTEGER, GL_UNSIGNED_INT, ids.data());
  DIORAMA_CHECK(gl.GetError() == GL_NO_ERROR);
}

}  // namespace diorama
