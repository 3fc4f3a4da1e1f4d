#include "app/video_writer.h"

#include <condition_variable>
#include <deque>
#include <mutex>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <thread>

#include "core/errors.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

constexpr size_t kQueueLimit = 16;

}  // namespace

struct VideoWriter::Impl {
  fs::path file;
  fs::path partial;
  cv::VideoWriter writer;
  std::mutex mutex;
  std::condition_variable changed;
  std::deque<Image<Rgb8>> queue;
  bool closed = false;
  std::thread thread;

  void encode() {
    while (true) {
      std::unique_lock lock(mutex);
      changed.wait(lock, [&] { return closed || !queue.empty(); });
      if (queue.empty()) return;
      Image<Rgb8> picture = std::move(queue.front());
      queue.pop_front();
      lock.unlock();
      changed.notify_all();
      const cv::Mat rgb(picture.height, picture.width, CV_8UC3, picture.pixels.data());
      cv::Mat bgr;
      cv::cvtColor(rgb, bgr, cv::COLOR_RGB2BGR);
      writer.write(bgr);
    }
  }

  void close() {
    {
      const std::lock_guard lock(mutex);
      closed = true;
    }
    changed.notify_all();
    if (thread.joinable()) thread.join();
    writer.release();
  }
};

VideoWriter::VideoWriter(fs::path file, int width, int height, double rate_hz)
    : impl_(std::make_unique<Impl>()) {
  impl_->file = std::move(file);
  impl_->partial = impl_->file;
  impl_->partial.replace_extension(".partial" + impl_->file.extension().string());
  const int avc1 = cv::VideoWriter::fourcc('a', 'v', 'c', '1');
  if (!impl_->writer.open(impl_->partial.string(), cv::CAP_FFMPEG, avc1, rate_hz, {width, height}))
    throw OutputError(impl_->file, "the video cannot be opened; --no-video goes without it");
  impl_->thread = std::thread([this] { impl_->encode(); });
}

VideoWriter::~VideoWriter() {
  if (!impl_) return;
  impl_->close();
  std::error_code error;
  fs::remove(impl_->partial, error);
}

void VideoWriter::add(Image<Rgb8> picture) {
  {
    std::unique_lock lock(impl_->mutex);
    impl_->changed.wait(lock, [&] { return impl_->queue.size() < kQueueLimit; });
    impl_->queue.push_back(std::move(picture));
  }
  impl_->changed.notify_all();
}

void VideoWriter::finish() {
  impl_->close();
  std::error_code error;
  if (fs::file_size(impl_->partial, error) == 0 || error)
    throw OutputError(impl_->file, "the video could not be written");
  fs::rename(impl_->partial, impl_->file, error);
  if (error) throw OutputError(impl_->file, error.message());
}

}  // namespace diorama
