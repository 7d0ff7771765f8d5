#include <arpa/inet.h>
#include <fmt/format.h>
#include <unistd.h>

#include <array>
#include <chrono>
#include <sstream>

#include "common/bus/live_bus.hpp"
#include "deploy/cli/doctor_findings.hpp"

namespace understory::cli {
namespace {

/// A line of /proc/net/route.
struct Route {
  std::string interface;
  std::uint32_t destination = 0;  ///< Host byte order.
  std::uint32_t mask = 0;         ///< Host byte order.
  int metric = 0;

  bool leads_to(std::uint32_t address) const { return (address & mask) == destination; }
  bool is_as_good_as(const Route& other) const {
    return mask == other.mask && metric == other.metric;
  }
  bool is_better_than(const Route& other) const {
    return mask != other.mask ? mask > other.mask : metric < other.metric;
  }
};

/// Lines of another form and routes that are down are skipped.
std::vector<Route> parse_routes(const std::string& text) {
  std::vector<Route> routes;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::istringstream fields(line);
    Route route;
    std::uint32_t destination = 0;
    std::uint32_t gateway = 0;
    std::uint32_t flags = 0;
    std::uint32_t mask = 0;
    int references = 0;
    int uses = 0;
    fields >> route.interface >> std::hex >> destination >> gateway >> flags >> std::dec >>
        references >> uses >> route.metric >> std::hex >> mask;
    if (!fields || (flags & 1U) == 0) continue;
    route.destination = ntohl(destination);
    route.mask = ntohl(mask);
    routes.push_back(std::move(route));
  }
  return routes;
}

bool has_multicast(const std::string& flags) {
  constexpr unsigned long kMulticast = 0x1000;
  return (std::strtoul(flags.c_str(), nullptr, 16) & kMulticast) != 0;
}

constexpr const char* kRouteAdvice =
    "ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo src 127.0.0.1 (or deploy/setup)";

}  // namespace

std::vector<Finding> url_findings(const std::string& url) {
  const std::string complete = bus::complete_lcm_url(url);
  constexpr const char* kAdvice = "export LCM_DEFAULT_URL='udpm://239.255.76.67:7667?ttl=0'";
  if (!bus::is_udpm_url(complete)) {
    return {{Verdict::kBad, "bus", complete + ": no udpm:// URL: processes do not hear each other",
             kAdvice}};
  }
  try {
    if (bus::parse_udpm_url(complete).ttl == 0) return {{Verdict::kGood, "bus", complete, ""}};
  } catch (const bus::BusError& error) {
    return {{Verdict::kBad, "bus", error.what(), kAdvice}};
  }

  return {{Verdict::kAdvice, "bus",
           complete + ": a ttl above 0 sends everything to the network, where anyone can send, "
                      "too; processes start with --open-bus only",
           kAdvice}};
}

std::vector<Finding> route_findings(const bus::UdpmUrl& group, const std::string& routes,
                                    const std::string& lo_flags) {
  std::vector<Route> best;
  for (const Route& route : parse_routes(routes)) {
    if (!route.leads_to(group.address)) continue;
    if (!best.empty() && route.is_better_than(best.front())) best.clear();
    if (best.empty() || route.is_as_good_as(best.front())) best.push_back(route);
  }

  if (best.empty()) return {{Verdict::kBad, "route", "none to the multicast group", kRouteAdvice}};
  if (best.size() > 1) {
    return {
        {Verdict::kAdvice, "route",
         fmt::format("{} of the same rank to the multicast group, over {} and {}: a process may "
                     "use either",
                     best.size(), best[0].interface, best[1].interface),
         kRouteAdvice}};
  }
  const Route& route = best.front();
  if (route.interface == "lo" && !has_multicast(lo_flags)) {
    return {{Verdict::kBad, "route", "over lo, which has multicast switched off",
             "ip link set lo multicast on"}};
  }
  if (route.interface != "lo") {
    return {{Verdict::kAdvice, "route",
             fmt::format("to the multicast group over {}{}: when that goes down, processes do not "
                         "hear each other",
                         route.interface, route.mask == 0 ? ", by the default route" : ""),
             kRouteAdvice}};
  }
  return {{Verdict::kGood, "route", "to the multicast group over lo", ""}};
}

Finding multicast_finding(const std::string& url) {
  Finding finding{Verdict::kBad, "multicast", "", kRouteAdvice};
  try {
    bus::LiveBus bus(url);
    const auto channel = fmt::format("DOCTOR_{}", ::getpid());
    bool heard = false;
    bus.subscribe(channel, 1, [&](const bus::BusMessage&) { heard = true; });
    const auto start = std::chrono::steady_clock::now();

    const std::array<std::uint8_t, 5> text{'h', 'e', 'l', 'l', 'o'};
    if (bus.publish(channel, text)) {
      finding.text = "a message cannot be sent";
      return finding;
    }

    for (int i = 0; i < 10 && !heard; ++i) bus.handle_one(100);
    const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
    finding.text =
        "a message to ourselves does not arrive (a firewall may stop it: nft list ruleset)";
    if (!heard) return finding;
    return {Verdict::kGood, "multicast",
            fmt::format("a message went round in {:.1f} ms", took.count()), ""};
  } catch (const bus::BusError& error) {
    finding.text = error.what();
    const bool is_taken = finding.text.find("does not share") != std::string::npos;
    if (is_taken) finding.advice = "end that program, or use another port in LCM_DEFAULT_URL";
    return finding;
  }
}

}  // namespace understory::cli
