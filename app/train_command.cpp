#include <cstdio>

#include "app/command_line.h"
#include "app/object_training.h"
#include "app/run_options.h"
#include "core/errors.h"
#include "core/files.h"
#include "sim/mesh_import.h"
#include "sim/model_lookup.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

struct TrainArguments {
  std::vector<std::string> models;
  std::string output, options, up = "z";
  double scale = 1;
  std::vector<std::string> sets;
};

// One model: the file itself. Several: NAME.db in a folder.
fs::path databaseFile(const TrainArguments& arguments, const std::string& name) {
  if (arguments.models.size() == 1) return arguments.output;
  return fs::path(arguments.output) / (name + ".db");
}

int train(const TrainArguments& arguments) {
  if (arguments.up != "y" && arguments.up != "z")
    throw UsageError("--up " + arguments.up + ": possible: y, z");
  std::vector<YamlOverride> overrides;
  for (const std::string& set : arguments.sets)
    overrides.push_back(parseOverride("training." + set));
  const RunOptions options = readRunOptions(
      arguments.options.empty() ? std::nullopt : std::optional<fs::path>(arguments.options),
      overrides);
  std::vector<ModelFile> files;  // all are found before the work
  for (const std::string& name : arguments.models)
    files.push_back({findModel(name), arguments.scale, arguments.up == "y"});
  for (const ModelFile& file : files)
    createFolder(fs::absolute(databaseFile(arguments, file.mesh.stem().string())).parent_path());
  for (const ModelFile& file : files) {
    const std::string name = file.mesh.stem().string();
    const ObjectModel model{name, importMesh(file.mesh, {file.scale, file.y_up}), {}};
    const ObjectDatabase database = trainFrom(file, model, options.training);
    const fs::path output = databaseFile(arguments, name);
    writeDatabase(database, output);
    // The size tells a wrong --scale.
    const Vector3f size = model.mesh.maxCorner() - model.mesh.minCorner();
    std::printf("%s: %zu features in %zu views of %.3g x %.3g x %.3g m\n", output.c_str(),
                database.features.size(), database.views.size(), size.x(), size.y(), size.z());
  }
  return kExitDone;
}

}  // namespace

std::function<int()> setUpTrain(CLI::App& app) {
  auto arguments = std::make_shared<TrainArguments>();
  app.add_option("MODEL", arguments->models, "meshes, or names of folders under models/")
      ->required();
  app.add_option("-o,--output", arguments->output,
                 "database to write; several models: a folder for NAME.db")
      ->required();
  app.add_option("--scale", arguments->scale, "metres per unit of the mesh files")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  app.add_option("--up", arguments->up, "axis of the mesh files that points up: y or z")
      ->capture_default_str();
  app.add_option("--options", arguments->options, "YAML file with estimator options");
  app.add_option("--set", arguments->sets, "key=value: replaces an option of `training`")
      ->allow_extra_args(false);
  return [arguments] { return train(*arguments); };
}

}  // namespace diorama
