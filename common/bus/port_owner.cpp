#include "common/bus/port_owner.hpp"

#include <arpa/inet.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <sstream>

namespace understory::bus {
namespace {

constexpr std::size_t kMostOwners = 3;

std::string text_of(const std::filesystem::path& file) {
  std::ifstream stream(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(stream), {}};
}

/// One line of the table: "12: 00000000:1DF3 00000000:0000 07 0:0 00:0 0 USER 0 INODE ...".
bool parse_udp_line(const std::string& line, BoundSocket& socket) {
  std::istringstream words(line);
  std::string number, local, skipped;
  if (!(words >> number >> local)) return false;
  for (int i = 0; i < 5; ++i) words >> skipped;
  if (!(words >> socket.user >> skipped >> socket.inode)) return false;

  const std::size_t colon = local.find(':');
  if (colon == std::string::npos || local.size() < colon + 5) return false;
  const std::string address = local.substr(0, colon);
  socket.is_any_address = address.find_first_not_of('0') == std::string::npos;
  unsigned port = 0;
  unsigned raw = 0;
  if (std::sscanf(local.c_str() + colon + 1, "%4x", &port) != 1) return false;
  socket.port = static_cast<std::uint16_t>(port);
  // The kernel prints the number in its memory byte order.
  if (address.size() == 8 && std::sscanf(address.c_str(), "%8x", &raw) == 1) {
    socket.address = ntohl(raw);
  }
  return true;
}

/// The inode of the socket at /proc/PID/fd/N; 0 = no socket, or not readable.
std::uint64_t socket_inode(const std::filesystem::path& link) {
  std::error_code error;
  const std::string target = std::filesystem::read_symlink(link, error).string();
  unsigned long long inode = 0;
  if (error || std::sscanf(target.c_str(), "socket:[%llu]", &inode) != 1) return 0;
  return inode;
}

/// "`name` (process 12, " of a process; the name is printable on a terminal.
std::string process_name(const std::filesystem::path& process) {
  std::string name = text_of(process / "comm");
  while (!name.empty() && name.back() == '\n') name.pop_back();
  std::replace_if(
      name.begin(), name.end(), [](char c) { return c < 0x20 || c > 0x7E; }, '?');
  return "`" + name + "` (process " + process.filename().string() + ", ";
}

/// The processes with these sockets, by inode, as far as they are readable.
std::map<std::uint64_t, std::string> holders_of(const std::vector<BoundSocket>& sockets) {
  namespace fs = std::filesystem;
  std::map<std::uint64_t, std::string> holders;
  std::error_code error;
  for (fs::directory_iterator process("/proc", error), end; !error && process != end;
       process.increment(error)) {
    const std::string pid = process->path().filename().string();
    if (pid.find_first_not_of("0123456789") != std::string::npos) continue;
    std::error_code hidden;
    for (fs::directory_iterator file(process->path() / "fd", hidden); !hidden && file != end;
         file.increment(hidden)) {
      const std::uint64_t inode = socket_inode(file->path());
      const bool is_wanted =
          inode != 0 && std::any_of(sockets.begin(), sockets.end(),
                                    [&](const auto& socket) { return socket.inode == inode; });
      if (is_wanted) holders.emplace(inode, process_name(process->path()));
    }
  }
  return holders;
}

}  // namespace

std::vector<BoundSocket> parse_udp_table(const std::string& text) {
  std::vector<BoundSocket> sockets;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    BoundSocket socket;
    if (parse_udp_line(line, socket)) sockets.push_back(socket);
  }
  return sockets;
}

std::string owners_of_udp_port(std::uint32_t address, std::uint16_t port) {
  std::vector<BoundSocket> sockets;
  for (const char* table : {"/proc/net/udp", "/proc/net/udp6"}) {
    for (const BoundSocket& socket : parse_udp_table(text_of(table))) {
      const bool is_in_the_way = socket.is_any_address || socket.address == address;
      if (socket.port == port && is_in_the_way) sockets.push_back(socket);
    }
  }
  if (sockets.empty()) return "an unknown program";

  const auto holders = holders_of(sockets);
  std::string text;
  for (std::size_t i = 0; i < std::min(sockets.size(), kMostOwners); ++i) {
    const auto holder = holders.find(sockets[i].inode);
    if (i > 0) text += ", ";
    text += holder != holders.end() ? holder->second : "a program that cannot be looked into (";
    text += "user " + std::to_string(sockets[i].user) + ")";
  }
  if (sockets.size() > kMostOwners) {
    text += " and " + std::to_string(sockets.size() - kMostOwners) + " more";
  }
  return text;
}

}  // namespace understory::bus
