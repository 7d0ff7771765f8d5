// Which requests are answered at all.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/web/server.hpp"

namespace understory::web {

/// Whether a Host header names this server: localhost, an address in numbers, or one of `names`,
/// with any port. Numbers cannot be made to lead elsewhere; other names can (DNS rebinding).
bool is_own_host(std::string_view host, const std::vector<std::string>& names);

/// Whether a page of this origin may open the WebSocket: none (no browser), that of the Host
/// header, or an allowed one.
bool is_allowed_origin(std::string_view origin, std::string_view host,
                       const std::vector<std::string>& allowed);

/// The first of `ours` in the list that the client offers; none where there is none.
std::optional<std::string> chosen_subprotocol(std::string_view offered,
                                              const std::vector<std::string>& ours);

/// The path of a request target, without the query.
std::string_view path_of(std::string_view target);

}  // namespace understory::web
