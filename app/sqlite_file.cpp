#include "app/sqlite_file.h"

#include <sqlite3.h>

#include <memory>

#include "core/errors.h"
#include "core/text.h"

namespace diorama {
namespace fs = std::filesystem;
namespace {

class Database {
 public:
  explicit Database(fs::path file) : file_(std::move(file)) {
    check(sqlite3_open(file_.c_str(), &handle_));
  }
  ~Database() { sqlite3_close(handle_); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void run(const std::string& sql) {
    check(sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr));
  }
  void check(int code) {
    if (code != SQLITE_OK && code != SQLITE_DONE) throw OutputError(file_, sqlite3_errmsg(handle_));
  }
  sqlite3* handle() { return handle_; }

 private:
  fs::path file_;
  sqlite3* handle_ = nullptr;
};

std::string quotedName(const std::string& name) {
  std::string quoted = "\"";
  for (char c : name) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

void bindField(sqlite3_stmt* row, int place, const std::string& text) {
  if (text.empty()) {
    sqlite3_bind_null(row, place);
  } else if (const auto whole = parseInteger(text)) {
    sqlite3_bind_int64(row, place, *whole);
  } else if (const auto number = parseNumber(text)) {
    sqlite3_bind_double(row, place, *number);
  } else {
    sqlite3_bind_text(row, place, text.c_str(), -1, SQLITE_TRANSIENT);
  }
}

void writeTable(Database& database, const NamedTable& named) {
  std::string columns, places;
  for (const std::string& name : named.table->header) {
    columns += (columns.empty() ? "" : ", ") + quotedName(name);
    places += places.empty() ? "?" : ", ?";
  }
  database.run("CREATE TABLE " + quotedName(named.name) + " (" + columns + ")");
  sqlite3_stmt* statement = nullptr;
  const std::string sql = "INSERT INTO " + quotedName(named.name) + " VALUES (" + places + ")";
  database.check(sqlite3_prepare_v2(database.handle(), sql.c_str(), -1, &statement, nullptr));
  const std::unique_ptr<sqlite3_stmt, int (*)(sqlite3_stmt*)> row(statement, sqlite3_finalize);
  for (const auto& fields : named.table->rows) {
    for (size_t i = 0; i < fields.size(); ++i)
      bindField(statement, static_cast<int>(i + 1), fields[i]);
    database.check(sqlite3_step(statement));
    sqlite3_reset(statement);
  }
}

}  // namespace

void writeSqlite(const fs::path& file, const std::vector<NamedTable>& tables) {
  const fs::path partial = file.string() + ".partial";
  std::error_code error;
  fs::remove(partial, error);
  {
    Database database(partial);
    database.run("BEGIN");
    for (const NamedTable& table : tables) writeTable(database, table);
    database.run("COMMIT");
  }
  fs::rename(partial, file, error);
  if (error) throw OutputError(file, error.message());
}

}  // namespace diorama
