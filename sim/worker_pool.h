// A few threads that share a list of jobs. Which thread takes which job is left to chance: jobs
// must write to places of their own, so that results do not depend on the number of threads.
#pragma once

#include <atomic>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace diorama {

class WorkerPool {
 public:
  explicit WorkerPool(int threads);  // 0: as many as the machine has
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  // Calls job(0) ... job(count - 1), each once, and returns when all are done. The caller works
  // too. Jobs must not throw. One caller at a time, or any number when the pool has one thread.
  void run(int count, const std::function<void(int)>& job);

 private:
  void work();
  void takeJobs(const std::function<void(int)>& job, int count);

  std::vector<std::thread> threads_;
  std::mutex mutex_;
  std::condition_variable start_, done_;
  const std::function<void(int)>* job_ = nullptr;
  int count_ = 0;
  int round_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  std::atomic<int> next_{0};
};

}  // namespace diorama
