#include <unistd.h>

#include <cstdio>
#include <opencv2/core/version.hpp>

#include "app/command_line.h"
#include "app/sweep_spec.h"
#include "app/video_writer.h"
#include "app/workers.h"
#include "core/errors.h"
#include "core/files.h"
#include "sim/scene.h"
#include "sim/triangle_raster.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

struct Check {
  const char* name;
  std::function<std::string()> run;  // what was found; throws when it is not in order
};

std::string checkScenes() {
  int count = 0;
  for (const fs::directory_entry& entry :
       fs::recursive_directory_iterator(dataFolder() / "scenes")) {
    if (entry.path().extension() != ".yaml") continue;
    if (entry.path().parent_path().filename() == "sweeps") {
      sweepCells(readSweepSpec(entry.path()));
      continue;
    }
    loadScene(entry.path(), {parseOverride("occlude=[]")});  // solving would take seconds
    ++count;
  }
  if (count == 0)
    throw MissingInputError(dataFolder() / "scenes",
                            "set DIORAMA_DATA to the folder with models/ and scenes/");
  return std::to_string(count) + " in " + (dataFolder() / "scenes").string();
}

std::string checkCache() {
  const fs::path folder = cacheFolder();
  createFolder(folder);
  writeFileAtomically(folder / "doctor", "");
  fs::remove(folder / "doctor");
  return folder.string();
}

std::string checkVideo() {
  const fs::path file =
      fs::temp_directory_path() / ("diorama-doctor-" + std::to_string(::getpid()) + ".mp4");
  VideoWriter video(file, 64, 48, 30);
  video.add(Image<Rgb8>(64, 48));
  video.finish();
  fs::remove(file);
  return "H.264 can be written";
}

std::string checkOsMesa() {
  TriangleRaster raster({}, 4, 4);
  std::vector<uint32_t> ids;
  raster.draw({4, 4}, {}, ids);
  return "gives a context: --renderer raster can be used";
}

int examine() {
  const Check checks[] = {
      {"version", [] { return std::string(DIORAMA_VERSION); }},
      {"cores", [] { return std::to_string(workerCount()); }},
      {"OpenCV", [] { return std::string(CV_VERSION); }},
      {"scenes", checkScenes},
      {"cache", checkCache},
      {"video", checkVideo},
      {"OSMesa", checkOsMesa},
  };
  int code = kExitDone;
  for (const Check& check : checks) {
    std::string result;
    bool good = true;
    try {
      result = check.run();
    } catch (const std::exception& error) {
      result = error.what();
      good = false;
      code = kExitMissed;
    }
    std::printf("%-4s %-8s %s\n", good ? "ok" : "BAD", check.name, result.c_str());
  }
  return code;
}

}  // namespace

std::function<int()> setUpDoctor(CLI::App&) { return examine; }

}  // namespace diorama
