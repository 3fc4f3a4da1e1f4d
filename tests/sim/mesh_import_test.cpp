#include "sim/mesh_import.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <string>

#include "core/errors.h"
#include "core/files.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

class MeshImport : public testing::Test {
 protected:
  MeshImport() {
    const testing::TestInfo* info = testing::UnitTest::GetInstance()->current_test_info();
    folder_ = fs::path(testing::TempDir()) / (std::string("mesh_import_") + info->name());
    fs::remove_all(folder_);
    createFolder(folder_);
  }
  ~MeshImport() override { fs::remove_all(folder_); }

  fs::path write(const std::string& name, const std::string& content) {
    writeFileAtomically(folder_ / name, content);
    return folder_ / name;
  }

  // The one clear line that comes of a bad file.
  std::string problem(const std::string& content, const std::string& name = "bad.obj") {
    const fs::path file = write(name, content);
    try {
      importMesh(file);
    } catch (const InputError& error) {
      const std::string line = error.what();
      EXPECT_EQ(line.find('\n'), std::string::npos) << line;
      EXPECT_NE(line.find(name), std::string::npos) << line;
      return line;
    }
    return "no error";
  }

  fs::path folder_;
};

const char* const kQuad =
    "mtllib quad.mtl\nv -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\n"
    "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nvn 0 0 1\nusemtl paint\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

TEST_F(MeshImport, ReadsGeometryAndMaterial) {
  write("print.png", "not decoded here");
  write("quad.mtl",
        "newmtl paint\nKd 0.5 0.25 1\nKs 0.1 0.1 0.1\nNs 80\nKe 3 2 1\nmap_Kd print.png\n");
  const Mesh mesh = importMesh(write("quad.obj", kQuad));
  ASSERT_EQ(mesh.positions.size(), 4u);
  ASSERT_EQ(mesh.triangles.size(), 2u);
  EXPECT_EQ(mesh.minCorner(), Vector3f(-1, -1, 0));
  EXPECT_EQ(mesh.maxCorner(), Vector3f(1, 1, 0));
  for (const Vector3f& n : mesh.normals) EXPECT_EQ(n, Vector3f(0, 0, 1));
  for (size_t k = 0; k < 4; ++k) {  // v upwards, as in the file
    EXPECT_FLOAT_EQ(mesh.uvs[k].x(), mesh.positions[k].x() / 2 + 0.5f);
    EXPECT_FLOAT_EQ(mesh.uvs[k].y(), mesh.positions[k].y() / 2 + 0.5f);
  }
  const Material& paint = mesh.materials[static_cast<size_t>(mesh.triangle_materials[0])];
  EXPECT_TRUE(mesh.hasMaterials());
  EXPECT_EQ(paint.name, "paint");
  EXPECT_EQ(paint.diffuse, Vector3f(0.5f, 0.25f, 1));
  EXPECT_EQ(paint.emission, Vector3f(3, 2, 1));
  EXPECT_FLOAT_EQ(paint.specular, 0.1f);
  EXPECT_FLOAT_EQ(paint.shininess, 80);
  EXPECT_EQ(paint.texture.filename(), "print.png");
}

TEST_F(MeshImport, ScalesAndTurns) {
  const fs::path file = write("tri.obj", "v 0 0 0\nv 100 0 0\nv 0 200 50\nf 1 2 3\n");
  const Mesh mesh = importMesh(file, {.scale = 0.01, .y_up = true});
  EXPECT_FALSE(mesh.hasMaterials());
  ASSERT_EQ(mesh.positions.size(), 3u);
  EXPECT_TRUE(mesh.positions[2].isApprox(Vector3f(0, -0.5f, 2)));
  EXPECT_TRUE(mesh.normals[0].isApprox(Vector3f(0, -2, -0.5f).normalized()));
}

TEST_F(MeshImport, MakesSmoothNormalsExceptAtEdges) {
  // Two walls that meet at 90 degrees keep two normals; two at 11 degrees share one.
  const Mesh sharp =
      importMesh(write("sharp.obj", "v 0 0 0\nv 0 1 0\nv 1 0 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\n"));
  EXPECT_EQ(sharp.positions.size(), 6u);
  const Mesh smooth =
      importMesh(write("smooth.obj", "v 0 0 0\nv 0 1 0\nv 1 0 0\nv -1 0 0.2\nf 1 3 2\nf 1 2 4\n"));
  EXPECT_EQ(smooth.positions.size(), 4u);
}

TEST_F(MeshImport, DropsTrianglesWithoutArea) {
  const Mesh mesh = importMesh(
      write("thin.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 1 4\nf 1 2 4\n"));
  EXPECT_EQ(mesh.triangles.size(), 1u);
}

TEST_F(MeshImport, MissingFileIsMissingInput) {
  EXPECT_THROW(importMesh(folder_ / "absent.obj"), MissingInputError);
  EXPECT_THROW(importMesh(folder_), MissingInputError);
}

TEST_F(MeshImport, RejectsEmptyAndFaceless) {
  EXPECT_NE(problem("").find("empty"), std::string::npos);
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1 0\n"), "no error");
  EXPECT_NE(problem("# only words\n"), "no error");
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 2 0 0\nf 1 2 3\n"), "no error");  // no area
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nl 1 2\n"), "no error");
}

TEST_F(MeshImport, RejectsTruncated) {
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2").find("cut off"),
            std::string::npos);
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1/").find("cut off"), std::string::npos);
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1"), "no error");
  EXPECT_NE(problem("ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\n", "cut.ply"),
            "no error");
  EXPECT_NE(problem("glTF", "cut.glb"), "no error");
}

TEST_F(MeshImport, RejectsBadNumbersAndIndices) {
  EXPECT_NE(problem("v nan 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "no error");
  EXPECT_NE(problem("v inf 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n"), "no error");
  EXPECT_NE(problem("v 1e30 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").find("100 km"), std::string::npos);
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n").find("vertex 9"), std::string::npos);
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n"), "no error");
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1 0\nf -9 1 2\n"), "no error");
  EXPECT_NE(problem("v 0 0 0\nv 1 0 0\nv 0 1 0\nf a b c\n"), "no error");
}

// On which assimp would abort the process, read beyond its arrays, or allocate for minutes.
TEST_F(MeshImport, RejectsOffFilesThatDoNotKeepTheirPromises) {
  const std::string vertices = "0 0 0\n0.1 0 0\n0 0.1 0  # the third\n\n";
  EXPECT_EQ(importMesh(write("good.off", "OFF\n3 1 0\n" + vertices + "3 0 1 2\n")).triangles.size(),
            1u);
  EXPECT_EQ(importMesh(write("one.off", "OFF 3 1 0\n" + vertices + "3 0 1 2")).triangles.size(),
            1u);
  const std::pair<const char*, const char*> bad[] = {
      {"OFF\n3 1 0\n0 0 0 0.1\n0 0\n0 0.1 0\n3 0 1 2\n", "bad.off:4:1: a vertex has fewer"},
      {"OFF\n49999999999 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n", "cut off"},
      {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n0\n", "a face has fewer vertices than it says, or none"},
      {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n9 0 1 2\n", "fewer vertices than it says"},
      {"OFF\n3 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 3\n", "bad.off:6:1: a face refers to vertex 3 of 3"},
      {"OFF\n-3 1 0\n", "bad.off:2:1: expected the numbers"},
      {"nOFF 3\n3 1 0\n", "bad.off:1:1: expected a text"},
      {"OFF BINARY\n3 1 0\n", "bad.off:1:1: expected a text"}};
  for (const auto& [text, part] : bad)
    EXPECT_NE(problem(text, "bad.off").find(part), std::string::npos) << problem(text, "bad.off");
}

TEST_F(MeshImport, RejectsUnknownFormatAndMissingTexture) {
  EXPECT_NE(problem("hello", "mesh.xyz123"), "no error");
  write("quad.mtl", "newmtl paint\nmap_Kd absent.png\n");
  EXPECT_NE(problem(kQuad).find("absent.png"), std::string::npos);
}

}  // namespace
}  // namespace diorama
