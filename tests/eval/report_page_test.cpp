#include "eval/report_page.h"

#include <gmock/gmock.h>

#include "eval/error_figure.h"
#include "eval/mesh_preview.h"

namespace diorama {
namespace {

using testing::HasSubstr;
using testing::Not;

TEST(Base64, IsAsInRfc4648) {
  EXPECT_EQ(base64(""), "");
  EXPECT_EQ(base64("f"), "Zg==");
  EXPECT_EQ(base64("fo"), "Zm8=");
  EXPECT_EQ(base64("foobar"), "Zm9vYmFy");
  EXPECT_EQ(base64("\xff\xfe"), "//4=");
}

TEST(ReportPage, MarkupInDataStaysText) {
  const std::string evil = "</script><script>alert(1)</script>";
  const std::string page = reportPage({evil, "{\"name\": \"" + evil + "\"}", {}});
  EXPECT_THAT(page, Not(HasSubstr("alert(1)</script>")));
  EXPECT_THAT(page, HasSubstr("&lt;script&gt;alert(1)"));
  EXPECT_THAT(page, HasSubstr("\\u003c/script>\\u003cscript>alert(1)"));
}

TEST(ReportPage, IsOneSmallFileThatNeedsNoNetwork) {
  const std::string page = reportPage({"t", "{}", {"video"}});
  EXPECT_LT(page.size(), 1'000'000u);
  for (const char* outside : {" src=\"http", " href=\"http", "url(http", "@import", "{{"})
    EXPECT_THAT(page, Not(HasSubstr(outside)));
  EXPECT_THAT(page, HasSubstr("default-src 'none'"));
  EXPECT_THAT(page, HasSubstr("id=\"video0\">" + base64("video")));
}

TEST(ErrorFigure, EscapesTitlesAndTakesGaps) {
  const std::string svg = errorFigure(
      {{"a <b>", {0, 1, 2}, {{"m&m", {0.001, std::nullopt, 2.0}}}, {1.0, std::nullopt, 0.5}},
       {"empty", {}, {{"m&m", {}}}, {}}});
  EXPECT_THAT(svg, HasSubstr("a &lt;b&gt;"));
  EXPECT_THAT(svg, HasSubstr("m&amp;m"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_THAT(errorFigure({}), HasSubstr("</svg>"));
}

TEST(MeshPreview, KeepsToItsLimitAndToTheShape) {
  Mesh mesh;  // a fine square
  const int n = 100;
  for (int i = 0; i <= n; ++i)
    for (int j = 0; j <= n; ++j) mesh.positions.emplace_back(float(i) / n, float(j) / n, 0.0f);
  for (int i = 0; i < n; ++i)
    for (int j = 0; j < n; ++j) {
      const int a = i * (n + 1) + j;
      mesh.triangles.emplace_back(a, a + 1, a + n + 1);
      mesh.triangles.emplace_back(a + 1, a + n + 2, a + n + 1);
    }
  const Mesh small = previewMesh(mesh, 500);
  EXPECT_LE(small.triangles.size(), 500u);
  EXPECT_GT(small.triangles.size(), 50u);
  EXPECT_NEAR(small.diameter(), mesh.diameter(), 0.15);
  EXPECT_TRUE(previewMesh({}).triangles.empty());
}

}  // namespace
}  // namespace diorama
