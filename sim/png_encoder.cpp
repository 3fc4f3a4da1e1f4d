#include "sim/png_encoder.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cstring>
#include <queue>
#include <span>
#include <vector>

#include "core/errors.h"

namespace diorama {
namespace {

using Bytes = std::vector<uint8_t>;

// CRC-32 of PNG chunks, eight bytes at a time.
constexpr std::array<std::array<uint32_t, 256>, 8> makeCrcTables() {
  std::array<std::array<uint32_t, 256>, 8> tables{};
  for (uint32_t n = 0; n < 256; ++n) {
    uint32_t c = n;
    for (int bit = 0; bit < 8; ++bit) c = c & 1 ? 0xedb88320u ^ (c >> 1) : c >> 1;
    tables[0][n] = c;
  }
  for (size_t k = 1; k < 8; ++k)
    for (size_t n = 0; n < 256; ++n)
      tables[k][n] = tables[0][tables[k - 1][n] & 0xff] ^ (tables[k - 1][n] >> 8);
  return tables;
}
constexpr auto kCrc = makeCrcTables();

uint32_t crc32(std::span<const uint8_t> bytes) {
  uint32_t c = 0xffffffffu;
  size_t i = 0;
  for (; i + 8 <= bytes.size(); i += 8) {
    uint64_t word;
    std::memcpy(&word, bytes.data() + i, 8);
    word ^= c;
    c = 0;
    for (size_t k = 0; k < 8; ++k) c ^= kCrc[7 - k][word >> (8 * k) & 0xff];
  }
  for (; i < bytes.size(); ++i) c = kCrc[0][(c ^ bytes[i]) & 0xff] ^ (c >> 8);
  return ~c;
}

uint32_t adler32(const Bytes& bytes) {
  constexpr uint32_t kModulus = 65521;
  constexpr size_t kBlock = 5552;  // sums of so many bytes fit into 32 bits
  uint32_t a = 1, b = 0;
  for (size_t begin = 0; begin < bytes.size(); begin += kBlock) {
    const size_t end = std::min(begin + kBlock, bytes.size());
    for (size_t i = begin; i < end; ++i) b += a += bytes[i];
    a %= kModulus, b %= kModulus;
  }
  return b << 16 | a;
}

void putBigEndian(Bytes& out, uint32_t value) {
  for (int shift = 24; shift >= 0; shift -= 8) out.push_back(static_cast<uint8_t>(value >> shift));
}

// Deflate's lengths 3 to 258: symbol, number of extra bits and their value.
struct LengthCode {
  uint16_t symbol = 0;
  uint8_t extra_bits = 0;
  uint8_t extra = 0;
};
constexpr std::array<LengthCode, 259> makeLengthCodes() {
  std::array<LengthCode, 259> codes{};
  uint16_t symbol = 257;
  for (size_t length = 3; length < 258; ++symbol) {
    const uint8_t bits = static_cast<uint8_t>(symbol < 265 ? 0 : (symbol - 261) / 4);
    for (size_t extra = 0; extra < (size_t{1} << bits) && length < 258; ++extra, ++length)
      codes[length] = {symbol, bits, static_cast<uint8_t>(extra)};
  }
  codes[258] = {285, 0, 0};
  return codes;
}
constexpr auto kLengthCodes = makeLengthCodes();

constexpr size_t kSymbols = 286;
constexpr uint16_t kEndOfBlock = 256;
constexpr uint8_t kMaxCodeLength = 15;

// Lengths of a Huffman code; scaled-down counts when it would be deeper than deflate allows.
std::array<uint8_t, kSymbols> codeLengths(std::array<uint32_t, kSymbols> counts) {
  using Node = std::pair<uint64_t, size_t>;  // count, node
  while (true) {
    std::priority_queue<Node, std::vector<Node>, std::greater<>> heap;
    for (size_t s = 0; s < kSymbols; ++s)
      if (counts[s] > 0) heap.emplace(counts[s], s);
    std::vector<size_t> parent(2 * kSymbols, 0);
    size_t next = kSymbols;
    while (heap.size() > 1) {
      const Node a = heap.top();
      heap.pop();
      const Node b = heap.top();
      heap.pop();
      parent[a.second] = parent[b.second] = next;
      heap.emplace(a.first + b.first, next++);
    }
    std::array<uint8_t, kSymbols> lengths{};
    size_t deepest = 0;
    for (size_t s = 0; s < kSymbols; ++s) {
      if (counts[s] == 0) continue;
      size_t depth = 0;
      for (size_t node = s; node != next - 1; node = parent[node]) ++depth;
      deepest = std::max(deepest, depth);
      lengths[s] = static_cast<uint8_t>(std::max<size_t>(depth, 1));
    }
    if (deepest <= kMaxCodeLength) return lengths;
    for (uint32_t& count : counts) count = (count + 1) / 2;
  }
}

struct Code {
  uint16_t bits = 0;  // first bit lowest, as deflate sends it
  uint8_t length = 0;
};

std::array<Code, kSymbols> canonicalCodes(const std::array<uint8_t, kSymbols>& lengths) {
  std::array<Code, kSymbols> codes{};
  uint32_t next = 0;
  for (uint8_t length = 1; length <= kMaxCodeLength; ++length, next <<= 1) {
    for (size_t s = 0; s < kSymbols; ++s) {
      if (lengths[s] != length) continue;
      uint32_t reversed = 0;
      for (int bit = 0; bit < length; ++bit) reversed |= (next >> bit & 1) << (length - 1 - bit);
      codes[s] = {static_cast<uint16_t>(reversed), length};
      ++next;
    }
  }
  return codes;
}

class BitWriter {
 public:
  explicit BitWriter(Bytes& out) : out_(out) {}
  void put(uint64_t bits, int count) {  // at most 32 at a time
    buffer_ |= bits << filled_;
    filled_ += count;
    if (filled_ < 32) return;
    const size_t size = out_.size();
    out_.resize(size + 4);
    const uint32_t word = static_cast<uint32_t>(buffer_);
    std::memcpy(out_.data() + size, &word, 4);
    buffer_ >>= 32;
    filled_ -= 32;
  }
  void finish() {
    for (; filled_ > 0; filled_ -= 8, buffer_ >>= 8) out_.push_back(static_cast<uint8_t>(buffer_));
    filled_ = 0;
  }

 private:
  Bytes& out_;
  uint64_t buffer_ = 0;
  int filled_ = 0;
};

// How far the bytes at `i` repeat those `distance` before, at most 258.
size_t runLength(const Bytes& data, size_t i, size_t distance) {
  const size_t limit = std::min<size_t>(258, data.size() - i);
  size_t length = 0;
  for (; length + 8 <= limit; length += 8) {
    uint64_t now, before;
    std::memcpy(&now, data.data() + i + length, 8);
    std::memcpy(&before, data.data() + i + length - distance, 8);
    if (now != before) return length + static_cast<size_t>(std::countr_zero(now ^ before)) / 8;
  }
  while (length < limit && data[i + length] == data[i + length - distance]) ++length;
  return length;
}

// Bytes stand for themselves, 256 + n for a run of n.
std::vector<uint16_t> tokenise(const Bytes& data, size_t distance) {
  constexpr size_t kLeastRun = 4;
  std::vector<uint16_t> tokens(data.size());
  size_t count = 0;
  for (size_t i = 0; i < data.size();) {
    uint32_t now = 0, before = 1;
    if (i >= distance && i + 4 <= data.size()) {
      std::memcpy(&now, data.data() + i, 4);
      std::memcpy(&before, data.data() + i - distance, 4);
    }
    const size_t run = now == before ? runLength(data, i, distance) : 0;
    if (run >= kLeastRun) {
      tokens[count++] = static_cast<uint16_t>(256 + run);
      i += run;
    } else {
      tokens[count++] = data[i++];
    }
  }
  tokens.resize(count);
  return tokens;
}

// One dynamic block. The code lengths are sent with a code of 16 symbols of 4 bits each.
void writeBlock(const std::vector<uint16_t>& tokens, size_t distance, BitWriter& out) {
  std::array<uint32_t, kSymbols> counts{};
  for (uint16_t token : tokens) ++counts[token < 256 ? token : kLengthCodes[token - 256u].symbol];
  counts[kEndOfBlock] = 1;
  const std::array<uint8_t, kSymbols> lengths = codeLengths(counts);
  const std::array<Code, kSymbols> codes = canonicalCodes(lengths);

  out.put(1, 1);               // the last block
  out.put(2, 2);               // dynamic codes
  out.put(kSymbols - 257, 5);  // number of literal and length codes
  out.put(distance - 1, 5);    // number of distance codes less one
  out.put(19 - 4, 4);          // all code-length codes, in deflate's order 16 17 18 0 8 7 ...
  for (int i = 0; i < 19; ++i) out.put(i < 3 ? 0 : 4, 3);
  const auto put_length = [&](uint32_t n) {  // canonical code = the number, first bit highest
    out.put((n & 1) << 3 | (n & 2) << 1 | (n & 4) >> 1 | (n & 8) >> 3, 4);
  };
  for (uint8_t length : lengths) put_length(length);
  for (size_t d = 1; d <= distance; ++d) put_length(d == distance ? 1 : 0);

  for (uint16_t token : tokens) {
    if (token < 256) {
      out.put(codes[token].bits, codes[token].length);
      continue;
    }
    const LengthCode& run = kLengthCodes[token - 256u];
    out.put(codes[run.symbol].bits, codes[run.symbol].length);
    out.put(run.extra, run.extra_bits);
    out.put(0, 1);  // the only distance code
  }
  out.put(codes[kEndOfBlock].bits, codes[kEndOfBlock].length);
  out.finish();
}

void putChunk(Bytes& out, const char* type, const Bytes& content) {
  putBigEndian(out, static_cast<uint32_t>(content.size()));
  const size_t begin = out.size();
  out.insert(out.end(), type, type + 4);
  out.insert(out.end(), content.begin(), content.end());
  putBigEndian(out, crc32(std::span(out).subspan(begin)));
}

// Rows of `stride` bytes with a filter byte before each.
Bytes filterRows(const uint8_t* data, size_t height, size_t stride, size_t pixel_bytes,
                 PngContent content) {
  constexpr uint8_t kUp = 2, kAverage = 3;
  Bytes rows((stride + 1) * height);
  const Bytes zeros(stride, 0);
  for (size_t y = 0; y < height; ++y) {
    const uint8_t* now = data + y * stride;
    const uint8_t* up = y > 0 ? now - stride : zeros.data();
    uint8_t* out = rows.data() + y * (stride + 1);
    *out++ = content == PngContent::kPicture ? kAverage : kUp;
    if (content == PngContent::kLabels) {
      for (size_t x = 0; x < stride; ++x) out[x] = static_cast<uint8_t>(now[x] - up[x]);
      continue;
    }
    for (size_t x = 0; x < std::min(pixel_bytes, stride); ++x)
      out[x] = static_cast<uint8_t>(now[x] - up[x] / 2);
    for (size_t x = pixel_bytes; x < stride; ++x)
      out[x] = static_cast<uint8_t>(now[x] - (now[x - pixel_bytes] + up[x]) / 2);
  }
  return rows;
}

struct Format {
  uint8_t bit_depth, colour_type;
  size_t pixel_bytes;
};

std::string encode(const uint8_t* data, int width, int height, Format format, PngContent content) {
  DIORAMA_CHECK(width > 0 && height > 0);
  const size_t stride = static_cast<size_t>(width) * format.pixel_bytes;
  const Bytes rows =
      filterRows(data, static_cast<size_t>(height), stride, format.pixel_bytes, content);

  Bytes header;
  putBigEndian(header, static_cast<uint32_t>(width));
  putBigEndian(header, static_cast<uint32_t>(height));
  header.insert(header.end(), {format.bit_depth, format.colour_type, 0, 0, 0});
  Bytes compressed{0x78, 0x01};  // zlib: deflate, 32 KiB window, fastest
  compressed.reserve(rows.size());
  BitWriter bits(compressed);
  // Only distances up to 4 have a code without extra bits.
  const size_t distance = format.pixel_bytes <= 4 ? format.pixel_bytes : 1;
  writeBlock(tokenise(rows, distance), distance, bits);
  putBigEndian(compressed, adler32(rows));

  Bytes png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
  png.reserve(compressed.size() + 64);
  putChunk(png, "IHDR", header);
  putChunk(png, "IDAT", compressed);
  putChunk(png, "IEND", {});
  return {png.begin(), png.end()};
}

Bytes bigEndian(std::span<const uint16_t> values) {
  Bytes bytes(values.size() * 2);
  for (size_t i = 0; i < values.size(); ++i) {
    bytes[2 * i] = static_cast<uint8_t>(values[i] >> 8);
    bytes[2 * i + 1] = static_cast<uint8_t>(values[i]);
  }
  return bytes;
}

}  // namespace

uint32_t pngChecksum(std::string_view bytes) {
  return crc32({reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size()});
}

std::string encodePng(const Image<Rgb8>& image) {
  static_assert(sizeof(Rgb8) == 3);
  return encode(reinterpret_cast<const uint8_t*>(image.pixels.data()), image.width, image.height,
                {8, 2, 3}, PngContent::kPicture);
}

std::string encodePng(const Image<uint8_t>& image, PngContent content) {
  return encode(image.pixels.data(), image.width, image.height, {8, 0, 1}, content);
}

std::string encodePng(const Image<uint16_t>& image) {
  const Bytes bytes = bigEndian({image.pixels.data(), image.pixels.size()});
  return encode(bytes.data(), image.width, image.height, {16, 0, 2}, PngContent::kLabels);
}

std::string encodePng(const Image<Rgb16>& image) {
  static_assert(sizeof(Rgb16) == 6);
  const auto* values = reinterpret_cast<const uint16_t*>(image.pixels.data());
  const Bytes bytes = bigEndian({values, 3 * image.pixels.size()});
  return encode(bytes.data(), image.width, image.height, {16, 2, 6}, PngContent::kLabels);
}

}  // namespace diorama
