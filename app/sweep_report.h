// The report of a sweep from its folder.
//
// The data of the page is JSON: {kind: "sweep", name, factors: [{name, values: [label..]}], seeds,
// shares: [metric..] (with Wilson intervals over frames; the others: bootstrap over seeds), points:
// [{at: [..], values: {metric: [mean, low, high]}, cells: [{seed, status, code, command}]}],
// thresholds: [{text, met, detail}], cells, missing}.
#pragma once

#include <filesystem>

namespace diorama {

// Whether this is the folder of a sweep.
bool isSweepFolder(const std::filesystem::path& folder);

// Writes the page; throws MissingInputError or InputError for a folder that is no sweep's.
void writeSweepReport(const std::filesystem::path& folder, const std::filesystem::path& output);

}  // namespace diorama
