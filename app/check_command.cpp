#include <algorithm>
#include <atomic>
#include <cstdio>
#include <future>
#include <mutex>
#include <nlohmann/json.hpp>

#include "app/command_line.h"
#include "app/progress.h"
#include "app/workers.h"
#include "core/errors.h"
#include "core/text.h"
#include "eval/table.h"
#include "sim/sequence_check.h"

namespace diorama {
namespace {

struct CheckArguments {
  std::string sequence;
  bool json = false;
};

constexpr size_t kShown = 20;  // findings; all of them are in the JSON

// All parts by all cores; the findings in the order of the frames.
CheckResult checkAll(const SequenceCheck& check) {
  const int count = check.partCount();
  std::vector<CheckResult> results(static_cast<size_t>(count));
  Progress progress("checking", count);
  std::atomic<int> next{0}, done{0};
  std::mutex progress_mutex;
  const auto work = [&] {
    while (true) {
      const int part = next++;
      if (part >= count) return;
      throwIfInterrupted();
      results[static_cast<size_t>(part)] = check.checkPart(part);
      const std::lock_guard lock(progress_mutex);
      progress.update(++done);
    }
  };
  std::vector<std::future<void>> workers;
  for (int i = 0; i < workerCount(); ++i) workers.push_back(std::async(std::launch::async, work));
  for (std::future<void>& worker : workers) worker.wait();
  for (std::future<void>& worker : workers) worker.get();
  CheckResult all = check.checkWhole();
  for (const CheckResult& result : results) all.append(result);
  return all;
}

size_t findingsOf(const CheckResult& result, size_t check) {
  return static_cast<size_t>(
      std::count_if(result.findings.begin(), result.findings.end(),
                    [&](const CheckFinding& f) { return f.check == static_cast<Check>(check); }));
}

std::string asTable(const CheckResult& result) {
  Table table{{"check", "examined", "findings"}, {}};
  for (size_t i = 0; i < kCheckNames.size(); ++i) {
    const size_t findings = findingsOf(result, i);
    table.rows.push_back({kCheckNames[i],
                          result.examined[i] ? std::to_string(result.examined[i]) : "-",
                          findings ? std::to_string(findings)
                                   : std::string(result.examined[i] ? "none" : "not there")});
  }
  std::string text = formatTable(table);
  for (size_t i = 0; i < std::min(kShown, result.findings.size()); ++i)
    text += result.findings[i].file + ": " + result.findings[i].what + "\n";
  if (result.findings.size() > kShown)
    text += "... and " + std::to_string(result.findings.size() - kShown) + " more (--json)\n";
  return text + (result.findings.empty() ? "good\n" : "");
}

std::string asJson(const CheckResult& result) {
  nlohmann::ordered_json json;
  json["good"] = result.findings.empty();
  for (size_t i = 0; i < kCheckNames.size(); ++i)
    json["checks"][kCheckNames[i]] = {{"examined", result.examined[i]},
                                      {"findings", findingsOf(result, i)}};
  json["findings"] = nlohmann::ordered_json::array();
  for (const CheckFinding& finding : result.findings)
    json["findings"].push_back({{"check", kCheckNames[static_cast<size_t>(finding.check)]},
                                {"file", finding.file},
                                {"what", finding.what}});
  return json.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
}

int check(const CheckArguments& arguments) {
  const CheckResult result = checkAll(SequenceCheck(arguments.sequence));
  std::fputs((arguments.json ? asJson(result) : asTable(result)).c_str(), stdout);
  return result.findings.empty() ? kExitDone : kExitMissed;
}

}  // namespace

std::function<int()> setUpCheck(CLI::App& app) {
  auto arguments = std::make_shared<CheckArguments>();
  app.add_option("SEQUENCE", arguments->sequence, "sequence folder")->required();
  app.add_flag("--json", arguments->json, "print JSON, with every finding");
  return [arguments] { return check(*arguments); };
}

}  // namespace diorama
