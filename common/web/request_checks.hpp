// Checks whether a request may be answered.
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "common/web/server.hpp"

namespace understory::web {

/// Whether a Host header names this server: localhost, an address in numbers, or one of `names`,
/// with any port. Other names could be redirected here by an attacker (DNS rebinding); numeric
/// addresses cannot.
bool is_own_host(std::string_view host, const std::vector<std::string>& names);

/// Whether a page of this origin may open the WebSocket: no origin (no browser), the one of the
/// Host header, or an allowed one.
bool is_allowed_origin(std::string_view origin, std::string_view host,
                       const std::vector<std::string>& allowed);

/// The first of `ours` in the list that the client offers; none = no common one.
std::optional<std::string> chosen_subprotocol(std::string_view offered,
                                              const std::vector<std::string>& ours);

/// The path of a request target, without the query.
std::string_view path_of(std::string_view target);

}  // namespace understory::web
