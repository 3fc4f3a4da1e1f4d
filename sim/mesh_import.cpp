#include "sim/mesh_import.h"

#include <assimp/DefaultIOSystem.h>
#include <assimp/config.h>
#include <assimp/material.h>
#include <assimp/postprocess.h>
#include <assimp/scene.h>
#include <assimp/IOStream.hpp>

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <assimp/Importer.hpp>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <string>

#include "core/errors.h"
#include "core/files.h"
#include "sim/mesh_file_check.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr float kMaxCoordinate_m = 1e5f;
constexpr double kSmoothingAngle_deg = 45;

// Some of assimp's parsers read on for ever behind the end of a file that was cut off.
class GuardedStream : public Assimp::IOStream {
 public:
  explicit GuardedStream(std::unique_ptr<Assimp::IOStream> file) : file_(std::move(file)) {}
  size_t Read(void* to, size_t size, size_t count) override {
    const size_t read = file_->Read(to, size, count);
    if (read == 0 && ++reads_at_end_ > 1000) throw std::runtime_error("it ends too early");
    return read;
  }
  size_t Write(const void*, size_t, size_t) override { return 0; }
  aiReturn Seek(size_t offset, aiOrigin origin) override { return file_->Seek(offset, origin); }
  size_t Tell() const override { return file_->Tell(); }
  size_t FileSize() const override { return file_->FileSize(); }
  void Flush() override {}

 private:
  std::unique_ptr<Assimp::IOStream> file_;
  int reads_at_end_ = 0;
};

class GuardedFiles : public Assimp::DefaultIOSystem {
 public:
  Assimp::IOStream* Open(const char* file, const char* mode) override {
    std::unique_ptr<Assimp::IOStream> stream(Assimp::DefaultIOSystem::Open(file, mode));
    return stream ? new GuardedStream(std::move(stream)) : nullptr;
  }
  void Close(Assimp::IOStream* stream) override { delete stream; }
};

std::string firstLine(const std::string& text) { return text.substr(0, text.find('\n')); }

void checkParsed(const fs::path& file, const aiScene& scene) {
  for (unsigned m = 0; m < scene.mNumMeshes; ++m) {
    const aiMesh& mesh = *scene.mMeshes[m];
    for (unsigned v = 0; v < mesh.mNumVertices; ++v) {
      const aiVector3D& p = mesh.mVertices[v];
      if (!std::isfinite(p.x) || !std::isfinite(p.y) || !std::isfinite(p.z))
        throw InputError(file, "a vertex has a coordinate that is not finite");
    }
    for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
      const aiFace& face = mesh.mFaces[f];
      if (face.mNumIndices == 0)  // assimp aborts the process when it cuts such a face up
        throw InputError(file, "a face has no vertices");
      for (unsigned k = 0; k < face.mNumIndices; ++k)
        if (face.mIndices[k] >= mesh.mNumVertices)
          throw InputError(file, "a face refers to a vertex that is not there");
    }
  }
}

const aiScene& parse(const fs::path& file, Assimp::Importer& importer) {
  importer.SetPropertyInteger(AI_CONFIG_PP_SBP_REMOVE,
                              aiPrimitiveType_POINT | aiPrimitiveType_LINE);
  importer.SetPropertyFloat(AI_CONFIG_PP_GSN_MAX_SMOOTHING_ANGLE,
                            static_cast<ai_real>(kSmoothingAngle_deg));
  importer.SetPropertyBool(AI_CONFIG_IMPORT_COLLADA_IGNORE_UP_DIRECTION, true);
  importer.SetIOHandler(new GuardedFiles);  // the importer owns it
  try {
    // First only read: the later steps trust what they are given.
    const aiScene* scene = importer.ReadFile(file.string(), 0);
    if (scene == nullptr) throw InputError(file, firstLine(importer.GetErrorString()));
    checkParsed(file, *scene);
    scene =
        importer.ApplyPostProcessing(aiProcess_Triangulate | aiProcess_SortByPType |
                                     aiProcess_GenSmoothNormals | aiProcess_JoinIdenticalVertices);
    if (scene == nullptr || scene->mRootNode == nullptr)
      throw InputError(file, "the mesh has no triangles");
    return *scene;
  } catch (const Error&) {
    throw;
  } catch (const std::exception& problem) {
    throw InputError(file, "cannot be read as a mesh: " + firstLine(problem.what()));
  }
}

Vector3f color(const aiMaterial& material, const char* key, unsigned type, unsigned index,
               const Vector3f& fallback) {
  aiColor3D value;
  if (material.Get(key, type, index, value) != AI_SUCCESS) return fallback;
  const Vector3f c(value.r, value.g, value.b);
  return c.allFinite() ? Vector3f(c.cwiseMax(0.f)) : fallback;
}

fs::path texturePath(const fs::path& file, const aiMaterial& material) {
  aiString name;
  if (material.GetTexture(aiTextureType_DIFFUSE, 0, &name) != AI_SUCCESS) return {};
  std::string text = name.C_Str();
  if (text.starts_with('*'))
    throw InputError(file, "textures inside the file are not supported",
                     "export them as files of their own");
  std::replace(text.begin(), text.end(), '\\', '/');
  const fs::path path = fs::path(text).is_absolute() ? fs::path(text) : file.parent_path() / text;
  std::error_code error;
  if (!fs::is_regular_file(path, error))
    throw InputError(file, "its texture " + path.string() + " is not there");
  return path;
}

Material importMaterial(const fs::path& file, const aiMaterial& source) {
  Material material;
  aiString name;
  if (source.Get(AI_MATKEY_NAME, name) == AI_SUCCESS && name != aiString(AI_DEFAULT_MATERIAL_NAME))
    material.name = name.C_Str();
  material.diffuse = color(source, AI_MATKEY_COLOR_DIFFUSE, material.diffuse);
  material.emission = color(source, AI_MATKEY_COLOR_EMISSIVE, Vector3f::Zero());
  const Vector3f specular =
      color(source, AI_MATKEY_COLOR_SPECULAR, Vector3f::Constant(material.specular));
  material.specular = std::min(specular.mean(), 1.f);
  float shininess = 0;
  if (source.Get(AI_MATKEY_SHININESS, shininess) == AI_SUCCESS && std::isfinite(shininess))
    material.shininess = std::clamp(shininess, 1.f, 1e4f);
  material.texture = texturePath(file, source);
  return material;
}

class Importer {
 public:
  Importer(const fs::path& file, const aiScene& scene, const MeshImportOptions& options)
      : file_(file), scene_(scene) {
    toMetres_ = Eigen::Matrix4f::Identity();
    if (options.y_up)
      toMetres_.topLeftCorner<3, 3>() << 1, 0, 0, 0, 0, -1, 0, 1, 0;  // (x, y, z) -> (x, -z, y)
    toMetres_.topLeftCorner<3, 3>() *= static_cast<float>(options.scale);
  }

  Mesh run() {
    for (unsigned m = 0; m < scene_.mNumMaterials; ++m)
      mesh_.materials.push_back(importMaterial(file_, *scene_.mMaterials[m]));
    if (mesh_.materials.empty()) mesh_.materials.emplace_back();
    addNode(*scene_.mRootNode, toMetres_, 0);
    if (mesh_.triangles.empty()) throw InputError(file_, "the mesh has no triangles");
    if (!has_uvs_) mesh_.uvs.clear();
    return std::move(mesh_);
  }

 private:
  void addNode(const aiNode& node, const Eigen::Matrix4f& parent, int depth) {
    if (depth > 200) throw InputError(file_, "its nodes are nested too deeply");
    const aiMatrix4x4& t = node.mTransformation;
    Eigen::Matrix4f local;
    local << t.a1, t.a2, t.a3, t.a4, t.b1, t.b2, t.b3, t.b4, t.c1, t.c2, t.c3, t.c4, t.d1, t.d2,
        t.d3, t.d4;
    const Eigen::Matrix4f transform = parent * local;
    for (unsigned m = 0; m < node.mNumMeshes; ++m)
      addMesh(*scene_.mMeshes[node.mMeshes[m]], transform);
    for (unsigned c = 0; c < node.mNumChildren; ++c)
      addNode(*node.mChildren[c], transform, depth + 1);
  }

  void addMesh(const aiMesh& source, const Eigen::Matrix4f& transform) {
    const int first = static_cast<int>(mesh_.positions.size());
    const Eigen::Matrix3f linear = transform.topLeftCorner<3, 3>();
    const Eigen::Matrix3f cofactors = linear.determinant() * linear.inverse().transpose();
    const float turn = linear.determinant() < 0 ? -1.f : 1.f;  // a mirror turns the winding
    const bool has_uvs = source.HasTextureCoords(0);
    has_uvs_ |= has_uvs;
    for (unsigned v = 0; v < source.mNumVertices; ++v) {
      const aiVector3D& p = source.mVertices[v];
      addVertex(linear * Vector3f(p.x, p.y, p.z) + transform.topRightCorner<3, 1>());
      Vector3f n = Vector3f::Zero();
      if (source.HasNormals())
        n = turn * cofactors *
            Vector3f(source.mNormals[v].x, source.mNormals[v].y, source.mNormals[v].z);
      mesh_.normals.push_back(n.allFinite() && n.norm() > 0 ? n.normalized() : Vector3f::Zero());
      Eigen::Vector2f uv = Eigen::Vector2f::Zero();
      if (has_uvs) uv << source.mTextureCoords[0][v].x, source.mTextureCoords[0][v].y;
      if (!uv.allFinite() || uv.cwiseAbs().maxCoeff() > 1e4f) uv.setZero();
      mesh_.uvs.push_back(uv);
    }
    for (unsigned f = 0; f < source.mNumFaces; ++f) {
      if (source.mFaces[f].mNumIndices != 3) continue;  // points and lines
      const unsigned* i = source.mFaces[f].mIndices;
      const std::array<int, 3> k = {first + static_cast<int>(i[0]), first + static_cast<int>(i[1]),
                                    first + static_cast<int>(i[2])};
      addTriangle(turn > 0 ? Eigen::Vector3i(k[0], k[1], k[2]) : Eigen::Vector3i(k[0], k[2], k[1]),
                  static_cast<int>(source.mMaterialIndex));
    }
  }

  void addVertex(const Vector3f& p) {
    if (!p.allFinite() || p.cwiseAbs().maxCoeff() > kMaxCoordinate_m)
      throw InputError(file_, "a vertex lies more than 100 km from the origin",
                       "is the scale right?");
    mesh_.positions.push_back(p);
  }

  void addTriangle(const Eigen::Vector3i& triangle, int material) {
    const Vector3f &a = mesh_.positions[static_cast<size_t>(triangle[0])],
                   &b = mesh_.positions[static_cast<size_t>(triangle[1])],
                   &c = mesh_.positions[static_cast<size_t>(triangle[2])];
    const Vector3f cross = (b - a).cross(c - a);
    const float longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
    if (!(cross.norm() > 1e-6f * longest * longest)) return;  // no area, or not representable
    for (int k = 0; k < 3; ++k) {
      Vector3f& n = mesh_.normals[static_cast<size_t>(triangle[k])];
      if (n.isZero()) n = cross.normalized();
    }
    mesh_.triangles.push_back(triangle);
    mesh_.triangle_materials.push_back(
        std::clamp(material, 0, static_cast<int>(mesh_.materials.size()) - 1));
  }

  const fs::path& file_;
  const aiScene& scene_;
  Eigen::Matrix4f toMetres_;
  Mesh mesh_;
  bool has_uvs_ = false;
};

}  // namespace

Mesh importMesh(const fs::path& file, const MeshImportOptions& options) {
  checkMeshFile(file);
  Assimp::Importer importer;
  const aiScene& scene = parse(file, importer);
  return Importer(file, scene, options).run();
}

}  // namespace diorama
