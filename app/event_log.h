// What was decided, as events.csv tells it.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "app/pipeline_types.h"

namespace diorama {

// A decision that is repeated frame by frame is one event, with its beginning, its end and the
// number of its frames; value and reason are those of the beginning.
class EventLog {
 public:
  // All events of the next frame.
  void add(const std::vector<Event>& events);
  // timestamp,source,event,value,reason,until,frames
  std::string csv() const;

 private:
  struct Entry {
    Event event;
    int64_t until_ns = 0;
    int frames = 1;
  };

  std::vector<Entry> entries_;
  std::vector<size_t> open_;  // those of the last frame
};

}  // namespace diorama
