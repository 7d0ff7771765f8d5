// Safe output of foreign text on a terminal.
#pragma once

#include <string>
#include <string_view>

namespace understory::terminal {

/// `text` with every byte that could control a terminal, or is not UTF-8, written as `\xNN`:
/// control characters (also those beyond ASCII), marks that turn the direction of writing, and
/// damaged or overlong sequences. Everything else stays as it is; the result is one line of valid
/// UTF-8.
std::string printable(std::string_view text);
/// The same, with unchanged line feeds: for messages of several lines.
std::string printable_lines(std::string_view text);

}  // namespace understory::terminal
