#include "app/event_log.h"

#include <algorithm>
#include <string_view>

#include "core/text.h"
#include "eval/csv.h"

namespace diorama {
namespace {

// Without its figures, which change from frame to frame.
std::string_view kindOf(const std::string& reason) {
  return std::string_view(reason).substr(0, reason.find_first_of("0123456789"));
}

bool isRepeated(const Event& a, const Event& b) {
  return a.source == b.source && a.event == b.event && kindOf(a.reason) == kindOf(b.reason);
}

}  // namespace

void EventLog::add(const std::vector<Event>& events) {
  std::vector<size_t> now;
  for (const Event& event : events) {
    const auto before = std::find_if(
        open_.begin(), open_.end(), [&](size_t k) { return isRepeated(entries_[k].event, event); });
    if (before == open_.end()) {
      now.push_back(entries_.size());
      entries_.push_back({event, event.timestamp_ns});
      continue;
    }
    Entry& entry = entries_[*before];
    entry.until_ns = event.timestamp_ns;
    ++entry.frames;
    now.push_back(*before);
    open_.erase(before);
  }
  open_ = std::move(now);
}

std::string EventLog::csv() const {
  std::string csv = "timestamp,source,event,value,reason,until,frames\n";
  for (const Entry& entry : entries_)
    csv += csvLine({formatSeconds(entry.event.timestamp_ns), entry.event.source, entry.event.event,
                    formatNumber(entry.event.value), entry.event.reason,
                    formatSeconds(entry.until_ns), std::to_string(entry.frames)});
  return csv;
}

}  // namespace diorama
