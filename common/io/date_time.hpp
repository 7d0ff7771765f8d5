// Dates with the time of day, as ISO 8601 writes them.
#pragma once

#include <string_view>
#include <vector>

#include "common/model/landmarks.hpp"

namespace understory::io {

/// Whether the text begins with a date ("2011-09-26") and not with a number.
bool begins_with_date(std::string_view text);

/// Reads one date and time per line: "2011-09-26 13:02:44.335092332",
/// "2011-09-26T15:02:44,3+02:00". A blank or T separates them; seconds may have any number of
/// digits (digits after the microsecond are cut off); Z or an offset follows, otherwise it is UTC.
/// Empty lines are skipped. Throws DataError with `source` and line.
std::vector<model::Utime> parse_date_times(std::string_view text, std::string_view source);

}  // namespace understory::io
