#include "tracker/object_database.h"

#include <gmock/gmock.h>

#include "core/errors.h"
#include "core/files.h"
#include "core/sha256.h"
#include "tests/support/temporary_folder.h"
#include "tests/tracker/box_scene.h"

namespace diorama {
namespace {

using ::testing::HasSubstr;

ObjectDatabase smallDatabase() {
  ObjectDatabase database;
  database.name = "box";
  database.mesh_sha256 = meshChecksum(test::boxMesh());
  database.kind = FeatureKind::kSurf;
  database.views = {SE3{}, test::boxPose(1)};
  database.features = {{Vector3f(0.1f, 0.2f, 0.3f), Vector3f::UnitZ(), 1}};
  for (int i = 0; i < descriptorSize(database.kind); ++i)
    database.descriptors.push_back(static_cast<uint8_t>(3 * i));
  database.looks = {
      {Vector3f::UnitX(), 0.01f, {Vector3f::UnitY()}, {Vector3f::UnitX()}, {Rgb8{77, 78, 79}}}};
  return database;
}

// What reading a file with this content says; empty when it is read.
std::string complaint(const std::string& content) {
  const test::TemporaryFolder folder;
  const auto file = folder.write("box.db", content);
  try {
    readDatabase(file);
    return "";
  } catch (const InputError& error) {
    EXPECT_EQ(error.code(), kExitBadData);
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos);
    return error.what();
  }
}

std::string writtenContent() {
  const test::TemporaryFolder folder;
  writeDatabase(smallDatabase(), folder / "box.db");
  return readFile(folder / "box.db");
}

// The same content under a checksum that fits.
std::string sealed(const std::string& content) {
  return "diorama-object-database 3\n" + sha256(content) + "\n" + content;
}

TEST(ObjectDatabase, ComesBackAsItWasWritten) {
  const test::TemporaryFolder folder;
  const ObjectDatabase written = smallDatabase();
  writeDatabase(written, folder / "box.db");
  const ObjectDatabase read = readDatabase(folder / "box.db");
  EXPECT_EQ(read.name, "box");
  EXPECT_EQ(read.mesh_sha256, written.mesh_sha256);
  EXPECT_EQ(read.kind, FeatureKind::kSurf);
  ASSERT_EQ(read.views.size(), 2u);
  EXPECT_EQ(read.views[1].translation, written.views[1].translation);
  ASSERT_EQ(read.features.size(), 1u);
  EXPECT_EQ(read.features[0].p_object, written.features[0].p_object);
  EXPECT_EQ(read.features[0].view, 1);
  EXPECT_EQ(read.descriptors, written.descriptors);
  ASSERT_EQ(read.looks.size(), 1u);
  EXPECT_EQ(read.looks[0].colors, written.looks[0].colors);
  EXPECT_EQ(read.looks[0].normals, written.looks[0].normals);
}

TEST(ObjectDatabase, AnyFlippedByteIsFound) {
  const std::string good = writtenContent();
  for (size_t at = 0; at < good.size(); at += 7) {
    std::string bad = good;
    bad[at] = static_cast<char>(bad[at] ^ 1);
    EXPECT_NE(complaint(bad), "") << "byte " << at;
  }
}

TEST(ObjectDatabase, TruncatedFilesAreFound) {
  const std::string good = writtenContent();
  for (const size_t size : {size_t{0}, size_t{5}, size_t{25}, size_t{26}, size_t{60}, size_t{91},
                            good.size() / 2, good.size() - 1})
    EXPECT_NE(complaint(good.substr(0, size)), "") << size << " bytes";
}

TEST(ObjectDatabase, SaysWhatIsWrong) {
  EXPECT_THAT(complaint("solid cube"), HasSubstr("no object database"));
  std::string other = writtenContent();
  other.replace(other.find(" 3\n"), 3, " 9\n");
  EXPECT_THAT(complaint(other), HasSubstr("version `9`, expected 3"));
  EXPECT_THAT(complaint(writtenContent() + "x"), HasSubstr("checksum"));
  const test::TemporaryFolder folder;
  EXPECT_THROW(readDatabase(folder / "nowhere.db"), MissingInputError);
  EXPECT_THROW(readDatabase(folder.path()), MissingInputError);
}

TEST(ObjectDatabase, ContentThatContradictsItselfIsRefused) {
  const std::string content = writtenContent().substr(sealed("").size());
  ASSERT_EQ(complaint(sealed(content)), "");
  for (size_t at = 0; at + 8 <= content.size(); at += 4) {  // a huge number, or none, anywhere
    std::string bad = content;
    bad.replace(at, 8, 8, '\xff');
    complaint(sealed(bad));  // an error or a database, but no crash
  }
  std::string huge = content;
  huge.replace(0, 8, 8, '\xff');
  EXPECT_THAT(complaint(sealed(huge)), HasSubstr("contradicts itself"));
  EXPECT_THAT(complaint(sealed("")), HasSubstr("contradicts itself"));
}

TEST(MeshChecksum, TellsShapesApart) {
  const std::string sum = meshChecksum(test::boxMesh());
  EXPECT_EQ(meshChecksum(test::boxMesh()), sum);
  EXPECT_NE(meshChecksum(test::boxMesh({{-0.05, -0.05, 0}, {0.05, 0.05, 0.21}})), sum);
}

}  // namespace
}  // namespace diorama
