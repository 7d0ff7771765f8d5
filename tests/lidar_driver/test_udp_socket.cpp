// The socket of a process without standard input.
#include <arpa/inet.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string_view>

#include "services/lidar_driver/udp_socket.hpp"
#include "tests/catch.hpp"

using namespace understory;

TEST_CASE("a socket may have descriptor 0", "[lidar_driver]") {
  const int standard_input = ::dup(STDIN_FILENO);
  ::close(STDIN_FILENO);
  {
    lidar_driver::UdpSocket socket("127.0.0.1", 0, 65536);
    CHECK(socket.file_descriptor() == STDIN_FILENO);
    CHECK_FALSE(socket.receive());

    sockaddr_in to{};
    to.sin_family = AF_INET;
    to.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    to.sin_port = htons(static_cast<std::uint16_t>(socket.port()));
    const int sender = ::socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    const std::string_view text = "packet";
    ::sendto(sender, text.data(), text.size(), 0, reinterpret_cast<const sockaddr*>(&to),
             sizeof(to));
    ::close(sender);
    const auto datagram = socket.receive();  // The loopback has delivered it already.
    CHECK((datagram && datagram->size == text.size()));
  }
  if (standard_input >= 0) {
    ::dup2(standard_input, STDIN_FILENO);
    ::close(standard_input);
  }
}
