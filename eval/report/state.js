// What is shown now: one position on the time line of the first run, which video, 3D view and plots follow.
class Timeline {
  constructor(times_s, frames) {
    this.times = times_s;
    this.frames = frames;
    this.index = 0;
    this.playing = false;
    this.listeners = [];
    this.clock = null;  // a video that leads while it plays
  }
  get length() { return this.times.length; }
  onChange(f) { this.listeners.push(f); }
  set(index, source = "user") {
    index = Math.max(0, Math.min(this.length - 1, Math.round(index)));
    if (this.length === 0) return;
    this.index = index;
    for (const f of this.listeners) f(index, source);
  }
  setTime(t) { this.set(this.nearest(t)); }
  nearest(t) {
    let low = 0, high = this.length - 1;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.times[middle] < t) low = middle + 1; else high = middle;
    }
    return low > 0 && t - this.times[low - 1] < this.times[low] - t ? low - 1 : low;
  }
  toggle() { this.playing ? this.stop() : this.play(); }
  play() {
    if (this.length < 2 || this.playing) return;
    if (this.index >= this.length - 1) this.set(0);
    this.playing = true;
    this.notify();
    if (this.clock) this.clock.start();
    const begin = performance.now(), from = this.times[this.index];
    const step = (now) => {
      if (!this.playing) return;
      const index = this.clock ? this.clock.index() : this.nearest(from + (now - begin) / 1000);
      if (index !== this.index) this.set(index, "clock");
      if (this.index >= this.length - 1 || (this.clock && this.clock.ended())) return this.stop();
      requestAnimationFrame(step);
    };
    requestAnimationFrame(step);
  }
  stop() {
    this.playing = false;
    if (this.clock) this.clock.stop();
    this.notify();
    this.set(this.index);
  }
  notify() { for (const f of this.listeners) f(this.index, "state"); }
}

// The overlay video of one run, from the bytes within the page; nothing when there is none.
const videoElement = (k) => {
  const holder = document.getElementById(`video${k}`);
  if (!holder || holder.textContent.length === 0) return null;
  const text = atob(holder.textContent);
  const bytes = new Uint8Array(text.length);
  for (let i = 0; i < text.length; ++i) bytes[i] = text.charCodeAt(i);
  holder.textContent = "";
  const video = el("video", { playsinline: true, muted: true, preload: "auto", "aria-label": "the pictures with estimated and true edges" });
  video.muted = true;
  video.src = URL.createObjectURL(new Blob([bytes], { type: "video/mp4" }));
  return video;
};

// Keeps a video on the time line. `positionOf` gives the video's frame of an index, `count` how many it has.
const followTimeline = (video, timeline, positionOf, count, leads) => {
  const interval = () => video.duration / count;
  let wanted = null;
  const seek = () => {
    if (!isNumber(video.duration) || wanted === null || video.seeking) return;
    const time = (wanted + 0.5) * interval();
    wanted = null;
    if (Math.abs(video.currentTime - time) > 0.2 * interval()) video.currentTime = time;
  };
  video.addEventListener("loadedmetadata", seek);
  video.addEventListener("seeked", seek);
  timeline.onChange((index, source) => {
    if (source === "state" || (source === "clock" && leads)) return;
    wanted = positionOf(index);
    seek();
  });
  if (!leads) return;
  let shown_s = null;  // of the picture on the screen
  const note = (now, picture) => {
    shown_s = picture.mediaTime;
    video.requestVideoFrameCallback(note);
  };
  if (video.requestVideoFrameCallback) video.requestVideoFrameCallback(note);
  timeline.clock = {
    start: () => video.play().catch(() => timeline.stop()),
    stop: () => video.pause(),
    ended: () => video.ended,
    index: () => {
      const time = shown_s === null ? video.currentTime : shown_s + 0.5 * interval();
      return Math.min(timeline.length - 1, Math.floor(time / interval() / positionOf(1)));
    },
  };
};
