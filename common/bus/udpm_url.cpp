#include "common/bus/udpm_url.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <charconv>
#include <string_view>

#include "common/bus/bus_error.hpp"

namespace understory::bus {
namespace {

constexpr std::string_view kScheme = "udpm://";

template <class Number>
Number number_in_url(std::string_view text, std::string_view what, const std::string& url) {
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (text.empty() || error != std::errc{} || end != text.data() + text.size()) {
    throw BusError(url + ": `" + std::string(text) + "` is no " + std::string(what));
  }
  return value;
}

std::uint32_t group_address(const std::string& text, const std::string& url) {
  in_addr address{};
  if (::inet_pton(AF_INET, text.c_str(), &address) != 1 || !IN_MULTICAST(ntohl(address.s_addr))) {
    throw BusError(url + ": `" + text + "` is no IPv4 multicast group");
  }
  return ntohl(address.s_addr);
}

/// The value of a key in `key=value&key=value`; empty = missing.
std::string_view value_of(std::string_view arguments, std::string_view key) {
  while (!arguments.empty()) {
    const std::string_view one = arguments.substr(0, arguments.find('&'));
    arguments.remove_prefix(std::min(arguments.size(), one.size() + 1));
    if (one.size() > key.size() && one.starts_with(key) && one[key.size()] == '=') {
      return one.substr(key.size() + 1);
    }
  }
  return {};
}

}  // namespace

bool is_udpm_url(const std::string& url) { return url.starts_with(kScheme); }

UdpmUrl parse_udpm_url(const std::string& url) {
  const std::string_view rest = std::string_view(url).substr(kScheme.size());
  const std::size_t question = rest.find('?');
  const std::string_view network = rest.substr(0, question);
  UdpmUrl result;

  const std::size_t colon = network.find(':');
  const std::string address(network.substr(0, colon));
  if (!address.empty()) result.address = group_address(address, url);
  if (colon != std::string_view::npos) {
    result.port = number_in_url<std::uint16_t>(network.substr(colon + 1), "port", url);
  }

  if (question == std::string_view::npos) return result;
  const std::string_view ttl = value_of(rest.substr(question + 1), "ttl");
  if (!ttl.empty()) result.ttl = number_in_url<std::uint8_t>(ttl, "TTL from 0 to 255", url);
  const std::string_view size = value_of(rest.substr(question + 1), "recv_buf_size");
  if (!size.empty()) {
    result.receive_buffer_bytes =
        number_in_url<std::uint32_t>(size, "number of bytes (recv_buf_size)", url);
  }
  return result;
}

}  // namespace understory::bus
