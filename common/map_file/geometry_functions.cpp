#include "common/map_file/geometry_functions.hpp"

#include <sqlite3.h>

#include <new>

#include "common/map_file/geometry_blob.hpp"

namespace understory::map_file {
namespace {

std::optional<Box> box_of_argument(sqlite3_value* value) {
  if (sqlite3_value_type(value) != SQLITE_BLOB) return std::nullopt;
  const auto* const bytes = static_cast<const std::uint8_t*>(sqlite3_value_blob(value));
  const auto size = static_cast<std::size_t>(sqlite3_value_bytes(value));
  const auto geometry = geometry_of({bytes, size});
  return geometry ? std::optional(box_of(*geometry)) : std::nullopt;
}

double side_of(const Box& box, int side) {
  const Eigen::Vector2d& corner = side < 2 ? box.low_m : box.high_m;
  return side % 2 == 0 ? corner.x() : corner.y();
}

/// Called by SQLite: no exception may pass through it.
template <class Work>
void guarded_in_sqlite(sqlite3_context* context, const Work& work) noexcept {
  try {
    work();
  } catch (...) {
    sqlite3_result_error_nomem(context);
  }
}

/// Sides: 0 = least x, 1 = least y, 2 = greatest x, 3 = greatest y.
template <int kSide>
void sql_side(sqlite3_context* context, int /*count*/, sqlite3_value** values) {
  guarded_in_sqlite(context, [&] {
    const auto box = box_of_argument(values[0]);
    box ? sqlite3_result_double(context, side_of(*box, kSide)) : sqlite3_result_null(context);
  });
}

void sql_is_empty(sqlite3_context* context, int /*count*/, sqlite3_value** values) {
  guarded_in_sqlite(context,
                    [&] { sqlite3_result_int(context, box_of_argument(values[0]) ? 0 : 1); });
}

using SqlFunction = void (*)(sqlite3_context*, int, sqlite3_value**);

void add_function(sqlite3* connection, const char* name, SqlFunction function) {
  // Innocuous, so that triggers of an untrusted schema may call them.
  constexpr int kFlags = SQLITE_UTF8 | SQLITE_DETERMINISTIC | SQLITE_INNOCUOUS;
  if (sqlite3_create_function_v2(connection, name, 1, kFlags, nullptr, function, nullptr, nullptr,
                                 nullptr) != SQLITE_OK)
    throw std::bad_alloc();
}

}  // namespace

void register_geometry_functions(sqlite3* connection) {
  add_function(connection, "ST_IsEmpty", sql_is_empty);
  add_function(connection, "ST_MinX", sql_side<0>);
  add_function(connection, "ST_MinY", sql_side<1>);
  add_function(connection, "ST_MaxX", sql_side<2>);
  add_function(connection, "ST_MaxY", sql_side<3>);
}

}  // namespace understory::map_file
