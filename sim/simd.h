// Eight numbers at a time: the arithmetic of GCC's vector extensions plus what they lack. AVX2
// instructions are used where the target has them; elsewhere the same results come from loops.
// Masks are Int8 with 0 or -1 per lane.
#pragma once

#include <cmath>
#include <cstdint>
#include <cstring>
#ifdef __AVX2__
#include <immintrin.h>
#endif

#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wpsabi"  // without AVX such values pass through memory: fine

namespace diorama::simd {

using Float8 = float __attribute__((vector_size(32)));
using Int8 = int __attribute__((vector_size(32)));

inline Float8 splat(float x) { return Float8{x, x, x, x, x, x, x, x}; }
inline Int8 splat(int x) { return Int8{x, x, x, x, x, x, x, x}; }

inline Float8 load(const float* p) {
  Float8 v;
  std::memcpy(&v, p, sizeof v);
  return v;
}
inline void store(float* p, Float8 v) { std::memcpy(p, &v, sizeof v); }
inline Float8 load2(const float* low, const float* high) {  // four lanes from each
  Float8 v;
  std::memcpy(&v, low, 16);
  std::memcpy(reinterpret_cast<char*>(&v) + 16, high, 16);
  return v;
}

inline Int8 load2(const int* low, const int* high) {
  Int8 v;
  std::memcpy(&v, low, 16);
  std::memcpy(reinterpret_cast<char*>(&v) + 16, high, 16);
  return v;
}

inline Float8 asFloat(Int8 v) { return reinterpret_cast<Float8>(v); }
inline Int8 asInt(Float8 v) { return reinterpret_cast<Int8>(v); }
inline Float8 toFloat(Int8 v) { return __builtin_convertvector(v, Float8); }
inline Int8 toInt(Float8 v) { return __builtin_convertvector(v, Int8); }  // towards zero

#ifdef __AVX2__
inline Float8 select(Int8 mask, Float8 a, Float8 b) {
  return _mm256_blendv_ps(b, a, asFloat(mask));
}
inline Int8 select(Int8 mask, Int8 a, Int8 b) {
  return asInt(select(mask, asFloat(a), asFloat(b)));
}
inline Float8 min(Float8 a, Float8 b) { return _mm256_min_ps(a, b); }
inline Float8 max(Float8 a, Float8 b) { return _mm256_max_ps(a, b); }
inline Int8 min(Int8 a, Int8 b) {
  return reinterpret_cast<Int8>(
      _mm256_min_epi32(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}
inline Int8 max(Int8 a, Int8 b) {
  return reinterpret_cast<Int8>(
      _mm256_max_epi32(reinterpret_cast<__m256i>(a), reinterpret_cast<__m256i>(b)));
}
inline Float8 sqrt(Float8 a) { return _mm256_sqrt_ps(a); }
inline Float8 floor(Float8 a) { return _mm256_floor_ps(a); }
inline int bits(Int8 mask) { return _mm256_movemask_ps(asFloat(mask)); }
inline void storeBytes(uint8_t* p, Int8 v) {  // the low byte of each
  const __m256i low =
      _mm256_shuffle_epi8(reinterpret_cast<__m256i>(v), _mm256_set1_epi32(0x0c080400));
  const __m128i both =
      _mm_unpacklo_epi32(_mm256_castsi256_si128(low), _mm256_extracti128_si256(low, 1));
  _mm_storel_epi64(reinterpret_cast<__m128i*>(p), both);
}
inline Int8 gather(const int* base, Int8 index) {
  return reinterpret_cast<Int8>(_mm256_i32gather_epi32(base, reinterpret_cast<__m256i>(index), 4));
}
// base[index] and base[index + 1]: eight loads, in half the time of two gathers.
inline void gatherPairs(const int* base, Int8 index, Int8& first, Int8& second) {
  alignas(32) int at[8];
  std::memcpy(at, &index, sizeof at);
  const auto two = [&](int a, int b) {
    const __m128i low = _mm_loadl_epi64(reinterpret_cast<const __m128i*>(base + at[a]));
    return _mm_loadh_pi(_mm_castsi128_ps(low), reinterpret_cast<const __m64*>(base + at[b]));
  };
  const auto four = [&](int a, int b) {
    return _mm256_insertf128_ps(_mm256_castps128_ps256(two(a, a + 1)), two(b, b + 1), 1);
  };
  const __m256 even = four(0, 4), odd = four(2, 6);
  first = asInt(_mm256_shuffle_ps(even, odd, 0x88));
  second = asInt(_mm256_shuffle_ps(even, odd, 0xdd));
}
#else
inline Int8 select(Int8 mask, Int8 a, Int8 b) { return (mask & a) | (~mask & b); }
inline Float8 select(Int8 mask, Float8 a, Float8 b) {
  return asFloat(select(mask, asInt(a), asInt(b)));
}
inline Float8 min(Float8 a, Float8 b) { return select(a < b, a, b); }
inline Float8 max(Float8 a, Float8 b) { return select(a > b, a, b); }
inline Int8 min(Int8 a, Int8 b) { return select(a < b, a, b); }
inline Int8 max(Int8 a, Int8 b) { return select(a > b, a, b); }
inline Float8 sqrt(Float8 a) {
  for (int i = 0; i < 8; ++i) a[i] = std::sqrt(a[i]);
  return a;
}
inline Float8 floor(Float8 a) {
  for (int i = 0; i < 8; ++i) a[i] = std::floor(a[i]);
  return a;
}
inline int bits(Int8 mask) {
  int result = 0;
  for (int i = 0; i < 8; ++i) result |= (mask[i] < 0) << i;
  return result;
}
inline void storeBytes(uint8_t* p, Int8 v) {
  for (int i = 0; i < 8; ++i) p[i] = static_cast<uint8_t>(v[i]);
}
inline Int8 gather(const int* base, Int8 index) {
  Int8 v;
  for (int i = 0; i < 8; ++i) v[i] = base[index[i]];
  return v;
}
inline void gatherPairs(const int* base, Int8 index, Int8& first, Int8& second) {
  first = gather(base, index);
  second = gather(base + 1, index);
}
#endif

inline Float8 abs(Float8 a) { return asFloat(asInt(a) & splat(0x7fffffff)); }
inline Float8 clamp(Float8 a, float low, float high) {
  return min(max(a, splat(low)), splat(high));
}
inline Float8 gather(const float* base, Int8 index) {
  return asFloat(gather(reinterpret_cast<const int*>(base), index));
}
inline Float8 inverseSqrt(Float8 a) { return splat(1.f) / sqrt(a); }

inline Int8 maskOfBits(int bits) {
  const Int8 bit = {1, 2, 4, 8, 16, 32, 64, 128};
  return (splat(bits) & bit) != splat(0);
}
inline Int8 firstLanes(int count) {  // mask of lanes 0 .. count - 1
  const Int8 lane = {0, 1, 2, 3, 4, 5, 6, 7};
  return lane < splat(count);
}

// log2 of a positive number, within 0.01: exponent plus a parabola for the mantissa.
inline Float8 log2Approximately(Float8 x) {
  const Int8 b = asInt(x);
  const Float8 exponent = toFloat((b >> 23) - 127);
  const Float8 m = asFloat((b & splat(0x007fffff)) | splat(0x3f800000));
  return exponent + (splat(-1.f / 3) * m + splat(2.f)) * m - splat(5.f / 3);
}

inline float least(Float8 v) {
  float result = v[0];
  for (int i = 1; i < 8; ++i) result = v[i] < result ? v[i] : result;
  return result;
}
inline float sum(Float8 v) {  // in a fixed order
  return ((v[0] + v[4]) + (v[1] + v[5])) + ((v[2] + v[6]) + (v[3] + v[7]));
}

struct Vector8 {  // eight vectors of three
  Float8 x, y, z;
};
inline Vector8 operator+(const Vector8& a, const Vector8& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
inline Vector8 operator-(const Vector8& a, const Vector8& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
inline Vector8 operator*(const Vector8& a, Float8 s) { return {a.x * s, a.y * s, a.z * s}; }
inline Vector8 operator*(const Vector8& a, const Vector8& b) {
  return {a.x * b.x, a.y * b.y, a.z * b.z};
}
inline Float8 dot(const Vector8& a, const Vector8& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vector8 splat3(float x, float y, float z) { return {splat(x), splat(y), splat(z)}; }
template <class V>
Vector8 splat3(const V& v) {
  return splat3(static_cast<float>(v[0]), static_cast<float>(v[1]), static_cast<float>(v[2]));
}
inline Vector8 min(const Vector8& a, Float8 b) { return {min(a.x, b), min(a.y, b), min(a.z, b)}; }
inline Vector8 select(Int8 mask, const Vector8& a, const Vector8& b) {
  return {select(mask, a.x, b.x), select(mask, a.y, b.y), select(mask, a.z, b.z)};
}

// The first four vectors one after the other, and so the last four.
inline void storeFours(float* low, float* high, const Vector8& v) {
#ifdef __AVX2__
  const __m256 xy01 = _mm256_unpacklo_ps(v.x, v.y), xy23 = _mm256_unpackhi_ps(v.x, v.y),
               z0x1 = _mm256_shuffle_ps(v.z, v.x, 0x50), y1z1 = _mm256_shuffle_ps(v.y, v.z, 0x55),
               z2x3 = _mm256_shuffle_ps(v.z, v.x, 0xfa), y3z3 = _mm256_shuffle_ps(v.y, v.z, 0xff);
  const __m256 parts[3] = {_mm256_shuffle_ps(xy01, z0x1, 0x84), _mm256_shuffle_ps(y1z1, xy23, 0x48),
                           _mm256_shuffle_ps(z2x3, y3z3, 0x88)};
  for (int k = 0; k < 3; ++k) {
    _mm_storeu_ps(low + 4 * k, _mm256_castps256_ps128(parts[k]));
    _mm_storeu_ps(high + 4 * k, _mm256_extractf128_ps(parts[k], 1));
  }
#else
  for (int lane = 0; lane < 8; ++lane) {
    float* to = lane < 4 ? low + 3 * lane : high + 3 * (lane - 4);
    to[0] = v.x[lane], to[1] = v.y[lane], to[2] = v.z[lane];
  }
#endif
}

}  // namespace diorama::simd

#pragma GCC diagnostic pop
