// Frames of a source as a YUV4MPEG2 stream, into a pipe or a file.
#pragma once

#include <string>
#include <vector>

#include "core/frame_source.h"

namespace diorama {

// Writes the frames in this order, as fast as they are made and taken, to the file `output`, or to
// standard output when it is `-`. A reader that closes the pipe ends the stream; a file appears
// under its name when it is complete. Returns how many frames were written. Throws OutputError.
int streamY4m(FrameSource& source, const std::vector<int>& frames, double rate_hz,
              const std::string& output);

}  // namespace diorama
