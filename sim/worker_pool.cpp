#include "sim/worker_pool.h"

#include <algorithm>

namespace diorama {

WorkerPool::WorkerPool(int threads) {
  if (threads <= 0) threads = static_cast<int>(std::max(1u, std::thread::hardware_concurrency()));
  for (int i = 1; i < threads; ++i) threads_.emplace_back([this] { work(); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  start_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void WorkerPool::run(int count, const std::function<void(int)>& job) {
  if (threads_.empty()) {  // nothing is shared: any number of callers
    for (int i = 0; i < count; ++i) job(i);
    return;
  }
  {
    const std::lock_guard lock(mutex_);
    job_ = &job;
    count_ = count;
    next_ = 0;
    busy_ = static_cast<int>(threads_.size());
    ++round_;
  }
  start_.notify_all();
  takeJobs(job, count);
  std::unique_lock lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
}

void WorkerPool::takeJobs(const std::function<void(int)>& job, int count) {
  for (int i = next_++; i < count; i = next_++) job(i);
}

void WorkerPool::work() {
  int seen = 0;
  std::unique_lock lock(mutex_);
  while (true) {
    start_.wait(lock, [&] { return stop_ || round_ != seen; });
    if (stop_) return;
    seen = round_;
    const std::function<void(int)>* job = job_;
    const int count = count_;
    lock.unlock();
    takeJobs(*job, count);
    lock.lock();
    if (--busy_ == 0) done_.notify_all();
  }
}

}  // namespace diorama
