// Seeded damage to texts, for tests of parsers.
#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <string>
#include <vector>

#include "core/errors.h"
#include "core/random.h"

namespace diorama::testing {

class Mutator {
 public:
  explicit Mutator(uint32_t seed) : random_(99, RandomStream::kTest), seed_(seed) {}

  std::string mutate(std::string text) {
    const uint32_t changes = 1 + draw(3);
    for (uint32_t i = 0; i < changes && !text.empty(); ++i) change(text);
    return text;
  }

 private:
  uint32_t draw(size_t n) { return random_.bits(seed_, counter_++)[0] % static_cast<uint32_t>(n); }

  void change(std::string& text) {
    static const std::vector<std::string> tokens = {
        "nan",    ".inf",     "-1",         "0",    "1e308", "1e-308", "999999999999999999999",
        "[",      "]",        "{",          "}",    ":",     ",",      "- ",
        "\n",     "  ",       "*a",         "&a",   "!!",    "~",      "''",
        "\"",     "#",        "%",          "../",  "\t",    "true",   "[]",
        "{}",     "|",        "???",        "\xff", "é",     "- - -",  ">",
        "<<: *a", "position", "2147483648", "0.25", "1",     "2",      "0.125",
        "3.5",    "33"};
    const size_t at = draw(text.size()), length = std::min<size_t>(draw(12), text.size() - at);
    switch (draw(5)) {
      case 0:
        text.erase(at, length);
        break;
      case 1:
        text[at] = static_cast<char>(draw(256));
        break;
      case 2:
        text.insert(at, text.substr(draw(text.size()), length));
        break;
      case 3: {  // a number becomes something else
        const size_t digit = text.find_first_of("0123456789", at);
        if (digit == std::string::npos) return;
        const size_t end = text.find_first_not_of("0123456789.e", digit);
        text.replace(digit, end - digit, tokens[draw(tokens.size())]);
        break;
      }
      default:
        text.insert(at, tokens[draw(tokens.size())]);
    }
  }

  Random random_;
  uint32_t seed_;
  uint64_t counter_ = 0;
};

// How many damaged files a test makes; DIORAMA_MUTATIONS=1000 asks for more than the usual.
inline uint32_t mutationCount(uint32_t usual) {
  const char* const asked = std::getenv("DIORAMA_MUTATIONS");
  return asked ? static_cast<uint32_t>(std::strtoul(asked, nullptr, 10)) : usual;
}

// What a damaged file did: threw one good line, or was accepted.
template <class Action>
bool survives(const Action& action, const std::string& text) {
  const auto start = std::chrono::steady_clock::now();
  bool accepted = false;
  try {
    action();
    accepted = true;
  } catch (const Error& error) {
    EXPECT_TRUE(error.code() == kExitBadData || error.code() == kExitMissingInput) << error.what();
    EXPECT_EQ(std::string(error.what()).find('\n'), std::string::npos) << error.what();
  } catch (const std::exception& error) {
    ADD_FAILURE() << error.what() << "\n" << text;
  }
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(20)) << text;
  return accepted;
}

}  // namespace diorama::testing
