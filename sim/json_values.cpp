#include "sim/json_values.h"

#include <algorithm>
#include <cmath>

#include "core/files.h"
#include "core/text.h"

namespace diorama {
namespace {

constexpr size_t kDeepest = 64;  // what nests deeper is no file of ours

// Brackets outside of texts, so that a hostile file cannot exhaust the parser's stack.
bool nestsTooDeep(const std::string& text) {
  size_t depth = 0;
  bool in_text = false;
  for (size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (in_text) {
      if (c == '\\') ++i;
      in_text = c != '"';
    } else if (c == '"') {
      in_text = true;
    } else if (c == '[' || c == '{') {
      if (++depth > kDeepest) return true;
    } else if ((c == ']' || c == '}') && depth > 0) {
      --depth;
    }
  }
  return false;
}

SourcePlace placeOf(const std::string& file, const std::string& text, size_t byte) {
  const size_t end = std::min(byte > 0 ? byte - 1 : 0, text.size());
  const auto stop = text.begin() + static_cast<long>(end);
  const size_t line = text.rfind('\n', end > 0 ? end - 1 : 0);
  const size_t start = end == 0 || line == std::string::npos ? 0 : line + 1;
  return {file, static_cast<int>(std::count(text.begin(), stop, '\n')) + 1,
          static_cast<int>(end - start) + 1};
}

}  // namespace

JsonValue JsonValue::load(const std::filesystem::path& file) {
  const std::string text = readFile(file);
  if (nestsTooDeep(text)) throw InputError(file, "nests too deep");
  try {
    const auto root = std::make_shared<const Document>(Document::parse(text));
    return JsonValue(root, root.get(), file.string(), "");
  } catch (const Document::parse_error& error) {
    throw InputError(placeOf(file.string(), text, error.byte), "is no JSON");
  } catch (const Document::exception&) {  // a number beyond all bounds
    throw InputError(file, "is no JSON that can be read");
  }
}

void JsonValue::fail(const std::string& what, const std::string& hint) const {
  std::string path = path_.empty() ? "the root" : "`" + path_ + "`";
  std::replace_if(
      path.begin(), path.end(), [](unsigned char c) { return c < ' '; }, '?');
  throw InputError(SourcePlace{file_}, path + " " + what, hint);
}

JsonValue JsonValue::child(const Document& value, const std::string& key) const {
  return JsonValue(root_, &value, file_, path_.empty() ? key : path_ + "." + key);
}

std::optional<JsonValue> JsonValue::find(const std::string& key) const {
  if (!value_->is_object()) fail("must be an object");
  const auto found = value_->find(key);
  if (found == value_->end()) return std::nullopt;
  return child(*found, key);
}

JsonValue JsonValue::require(const std::string& key) const {
  if (auto value = find(key)) return *value;
  fail("has no `" + key + "`");
}

std::vector<std::pair<std::string, JsonValue>> JsonValue::members() const {
  if (!value_->is_object()) fail("must be an object");
  std::vector<std::pair<std::string, JsonValue>> members;
  for (const auto& [key, value] : value_->items()) members.emplace_back(key, child(value, key));
  return members;
}

std::vector<JsonValue> JsonValue::asList() const {
  if (!value_->is_array()) fail("must be a list");
  std::vector<JsonValue> items;
  for (size_t i = 0; i < value_->size(); ++i)
    items.push_back(child((*value_)[i], std::to_string(i)));
  return items;
}

double JsonValue::asDouble() const {
  if (!value_->is_number()) fail("must be a number");
  const double number = value_->get<double>();
  if (!std::isfinite(number)) fail("must be finite");
  return number;
}

int64_t JsonValue::asInteger() const {
  if (!value_->is_number_integer()) fail("must be a whole number");
  if (value_->is_number_unsigned() && value_->get<uint64_t>() > INT64_MAX) fail("is too large");
  return value_->get<int64_t>();
}

std::string JsonValue::asString() const {
  if (!value_->is_string()) fail("must be a text");
  return value_->get<std::string>();
}

std::vector<double> JsonValue::asDoubles() const {
  std::vector<double> numbers;
  for (const JsonValue& item : asList()) numbers.push_back(item.asDouble());
  return numbers;
}

std::vector<double> JsonValue::asDoubles(size_t count) const {
  std::vector<double> numbers = asDoubles();
  if (numbers.size() != count)
    fail("must have " + std::to_string(count) + " numbers, not " + std::to_string(numbers.size()));
  return numbers;
}

}  // namespace diorama
