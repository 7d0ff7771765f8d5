#include "common/web/request_checks.hpp"

#include <arpa/inet.h>

#include <algorithm>

namespace understory::web {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

/// The host without port and without the brackets of IPv6.
std::string host_name(std::string_view host) {
  if (host.starts_with('[')) {
    const auto end = host.find(']');
    return end == std::string_view::npos ? std::string() : std::string(host.substr(1, end - 1));
  }
  return std::string(host.substr(0, host.find(':')));
}

bool is_in_numbers(const std::string& name) {
  in6_addr address{};
  return ::inet_pton(AF_INET, name.c_str(), &address) == 1 ||
         ::inet_pton(AF_INET6, name.c_str(), &address) == 1;
}

}  // namespace

bool is_own_host(std::string_view host, const std::vector<std::string>& names) {
  const std::string name = host_name(trimmed(host));
  return name == "localhost" || is_in_numbers(name) ||
         std::ranges::find(names, name) != names.end();
}

bool is_allowed_origin(std::string_view origin, std::string_view host,
                       const std::vector<std::string>& allowed) {
  if (origin.empty()) return true;
  if (origin == "http://" + std::string(host)) return true;
  return std::ranges::find(allowed, origin) != allowed.end();
}

std::optional<std::string> chosen_subprotocol(std::string_view offered,
                                              const std::vector<std::string>& ours) {
  std::vector<std::string_view> theirs;
  while (!offered.empty()) {
    const auto comma = offered.find(',');
    theirs.push_back(trimmed(offered.substr(0, comma)));
    offered = comma == std::string_view::npos ? std::string_view() : offered.substr(comma + 1);
  }
  for (const std::string& one : ours) {
    if (std::ranges::find(theirs, one) != theirs.end()) return one;
  }
  return std::nullopt;
}

std::string_view path_of(std::string_view target) { return target.substr(0, target.find('?')); }

}  // namespace understory::web
