#include "app/metrics_json.h"

#include <gtest/gtest.h>

#include <limits>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "core/files.h"
#include "tests/support/temporary_folder.h"

namespace diorama {
namespace {

Metrics someMetrics() {
  Metrics metrics;
  metrics.scene = "desk";
  metrics.method = "fused";
  metrics.initial = "given";
  metrics.seed = 18446744073709551615u;
  metrics.frames = 10;
  metrics.camera.ate_mean_m = 0.0031;
  metrics.camera.ate_rmse_m = std::numeric_limits<double>::quiet_NaN();
  metrics.objects.push_back({"carton", {}});
  metrics.objects[0].metrics.success_5cm_5deg = 0.995;
  metrics.objects[0].metrics.reinitialisations = 2;
  metrics.objects.push_back({"pasta", {}});
  metrics.objects[1].metrics.success_5cm_5deg = 0.9;
  return metrics;
}

TEST(MetricsJson, UnknownAndNaNAreNullAndNothingIsAbsent) {
  const auto json = nlohmann::json::parse(toJson(someMetrics()));
  EXPECT_TRUE(json.at("camera").at("ate_rmse_m").is_null());
  EXPECT_TRUE(json.at("camera").at("ate_median_m").is_null());
  EXPECT_EQ(json.at("camera").size(), 9u);
  EXPECT_EQ(json.at("objects").at("carton").size(), 18u);
  EXPECT_EQ(json.at("timing").size(), 7u);
  EXPECT_TRUE(json.at("peak_memory_mb").is_null());
}

TEST(MetricsJson, ReadsBackWhatItWrote) {
  const test::TemporaryFolder folder;
  writeFileAtomically(folder / "metrics.json", toJson(someMetrics()));
  EXPECT_EQ(toJson(metricsFromJson(folder / "metrics.json")), toJson(someMetrics()));
  writeFileAtomically(folder / "metrics.json", "{\"scene\": 3");
  EXPECT_THROW(metricsFromJson(folder / "metrics.json"), InputError);
  writeFileAtomically(folder / "metrics.json", "{}");
  EXPECT_THROW(metricsFromJson(folder / "metrics.json"), InputError);
}

TEST(Expectation, HoldsOrSaysByHowMuchItIsMissed) {
  const Metrics metrics = someMetrics();
  EXPECT_EQ(Expectation("camera.ate_mean_m<=0.01").missed(metrics), "");
  EXPECT_EQ(Expectation("objects.carton.success_5cm_5deg>=0.99").missed(metrics), "");
  EXPECT_NE(Expectation("success_5cm_5deg>=0.99")
                .missed(metrics)
                .find("objects.pasta.success_5cm_5deg is 0.9"),
            std::string::npos);
  EXPECT_EQ(Expectation("reinitialisations == 2").missed(metrics).find("carton"),
            std::string::npos);
  EXPECT_NE(Expectation("ate_median_m<1").missed(metrics).find("not known"), std::string::npos);
}

TEST(Expectation, RefusesWhatItDoesNotUnderstand) {
  for (const char* text : {"", ">=1", "a", "a=>1", "a>=", "a>=x", "a=1", "a<>1"})
    EXPECT_THROW(Expectation{text}, UsageError) << text;
  try {
    Expectation("ate_mean>=1").missed(someMetrics());
    FAIL();
  } catch (const UsageError& error) {
    EXPECT_NE(std::string(error.what()).find("ate_mean_m"), std::string::npos);
  }
}

}  // namespace
}  // namespace diorama
