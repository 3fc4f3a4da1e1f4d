#include "sim/png_decoder.h"

#include <libdeflate.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

namespace diorama {
namespace {

constexpr uint32_t kLargest = 1 << 15;  // pixels of a side; larger ones are left to others

uint32_t bigEndian(std::string_view bytes, size_t at) {
  uint32_t value = 0;
  for (size_t i = 0; i < 4; ++i) value = value << 8 | static_cast<uint8_t>(bytes[at + i]);
  return value;
}

struct Header {
  uint32_t width = 0, height = 0;
  size_t bytes_per_pixel = 0;  // 1 grey, 2 wide grey, 3 colour
  size_t stride() const { return width * bytes_per_pixel; }
};

std::optional<Header> readHeader(std::string_view ihdr) {
  if (ihdr.size() != 13) return std::nullopt;
  Header header{bigEndian(ihdr, 0), bigEndian(ihdr, 4), 0};
  const std::string_view kind = ihdr.substr(8);  // depth, colour, compression, filters, interlacing
  if (kind == std::string_view("\x08\0\0\0\0", 5)) header.bytes_per_pixel = 1;
  if (kind == std::string_view("\x10\0\0\0\0", 5)) header.bytes_per_pixel = 2;
  if (kind == std::string_view("\x08\2\0\0\0", 5)) header.bytes_per_pixel = 3;
  const auto fits = [](uint32_t side) { return 0 < side && side <= kLargest; };
  if (header.bytes_per_pixel == 0 || !fits(header.width) || !fits(header.height))
    return std::nullopt;
  return header;
}

struct Chunks {
  Header header;
  std::string pixels;  // still compressed
};

std::optional<Chunks> readChunks(std::string_view bytes) {
  Chunks chunks;
  bool ended = false;
  for (size_t at = 8; !ended;) {
    if (bytes.size() < at + 12) return std::nullopt;
    const size_t length = bigEndian(bytes, at);
    if (length > bytes.size() - at - 12) return std::nullopt;
    const std::string_view type = bytes.substr(at + 4, 4), content = bytes.substr(at + 8, length);
    if (type == "IHDR") {
      const std::optional<Header> header = readHeader(content);
      if (!header) return std::nullopt;
      chunks.header = *header;
    }
    if (type == "tRNS") return std::nullopt;
    if (type == "IDAT") chunks.pixels += content;
    ended = type == "IEND";
    at += length + 12;
  }
  if (chunks.header.width == 0) return std::nullopt;
  return chunks;
}

// One byte for the filter before each row.
std::optional<std::vector<uint8_t>> inflate(const Chunks& chunks) {
  struct Free {
    void operator()(libdeflate_decompressor* d) const { libdeflate_free_decompressor(d); }
  };
  const std::unique_ptr<libdeflate_decompressor, Free> inflater(libdeflate_alloc_decompressor());
  std::vector<uint8_t> rows(chunks.header.height * (1 + chunks.header.stride()));
  if (!inflater ||
      libdeflate_zlib_decompress(inflater.get(), chunks.pixels.data(), chunks.pixels.size(),
                                 rows.data(), rows.size(), nullptr) != LIBDEFLATE_SUCCESS)
    return std::nullopt;
  return rows;
}

// Without jumps: which of them is nearest to left + above - corner; the first of equals.
int paeth(int left, int above, int corner) {
  const int to_left = std::abs(above - corner), to_above = std::abs(left - corner),
            to_corner = std::abs(left + above - 2 * corner);
  const int other = to_above <= to_corner ? above : corner;
  return to_left <= std::min(to_above, to_corner) ? left : other;
}

// Each byte is its difference to what `predict` makes of the same byte of the pixel to the left, of
// that above and of that above to the left; n = bytes of a pixel.
template <size_t n, class Predict>
void addUp(const uint8_t* in, const uint8_t* above, size_t length, uint8_t* out, Predict predict) {
  int left[n] = {}, corner[n] = {};
  for (size_t i = 0; i < length; i += n)
    for (size_t k = 0; k < n; ++k) {
      const int up = above[i + k];
      left[k] = static_cast<uint8_t>(in[i + k] + predict(left[k], up, corner[k]));
      corner[k] = up;
      out[i + k] = static_cast<uint8_t>(left[k]);
    }
}

// The filters of the PNG specification (third edition), section 9.
template <size_t n>
bool unfilter(int filter, const uint8_t* in, const uint8_t* above, size_t length, uint8_t* out) {
  switch (filter) {
    case 0:
      std::memcpy(out, in, length);
      return true;
    case 1:
      addUp<n>(in, above, length, out, [](int left, int, int) { return left; });
      return true;
    case 2:
      for (size_t i = 0; i < length; ++i) out[i] = static_cast<uint8_t>(in[i] + above[i]);
      return true;
    case 3:
      addUp<n>(in, above, length, out, [](int left, int up, int) { return (left + up) / 2; });
      return true;
    case 4:
      addUp<n>(in, above, length, out, [](int a, int b, int c) { return paeth(a, b, c); });
      return true;
    default:
      return false;
  }
}

template <class T>
std::optional<PngImage> unfilterRows(const Header& header, const std::vector<uint8_t>& rows) {
  const size_t stride = header.stride();
  Image<T> image(static_cast<int>(header.width), static_cast<int>(header.height));
  const std::vector<uint8_t> nothing(stride, 0);
  const uint8_t* above = nothing.data();
  for (size_t y = 0; y < header.height; ++y) {
    const uint8_t* in = rows.data() + y * (1 + stride);
    auto* out = reinterpret_cast<uint8_t*>(image.row(static_cast<int>(y)));
    if (!unfilter<sizeof(T)>(in[0], in + 1, above, stride, out)) return std::nullopt;
    above = out;
  }
  return image;
}

}  // namespace

std::optional<PngImage> decodePng(std::string_view bytes) {
  if (!bytes.starts_with("\x89PNG\r\n\x1a\n")) return std::nullopt;
  const std::optional<Chunks> chunks = readChunks(bytes);
  if (!chunks) return std::nullopt;
  const std::optional<std::vector<uint8_t>> rows = inflate(*chunks);
  if (!rows) return std::nullopt;
  static_assert(sizeof(Rgb8) == 3);
  if (chunks->header.bytes_per_pixel == 1) return unfilterRows<uint8_t>(chunks->header, *rows);
  if (chunks->header.bytes_per_pixel == 3) return unfilterRows<Rgb8>(chunks->header, *rows);
  std::optional<PngImage> wide = unfilterRows<uint16_t>(chunks->header, *rows);
  if (wide)
    for (uint16_t& pixel : std::get<Image<uint16_t>>(*wide).pixels)
      pixel = static_cast<uint16_t>(pixel << 8 | pixel >> 8);  // the bytes are big endian
  return wide;
}

}  // namespace diorama
