// For the checks with the makers' own packages (tests/foxglove/node): a log, and a server of it.
//   foxglove_test_peer log OUT.lcm       a synthetic drive
//   foxglove_test_peer serve IN.lcm      serves it on a free port of loopback, prints the port,
//   gives
//                                        the log again and again to one client and ends with it
#include <boost/asio/ip/tcp.hpp>
#include <boost/beast/core.hpp>
#include <boost/beast/http.hpp>
#include <boost/beast/websocket.hpp>
#include <iostream>
#include <string>

#include "common/foxglove/session.hpp"
#include "common/io/lcm_log.hpp"
#include "common/web/request_checks.hpp"
#include "tests/foxglove/synthetic_drive.hpp"

namespace understory::test {
namespace {

namespace asio = boost::asio;
namespace beast = boost::beast;
using Socket = beast::websocket::stream<asio::ip::tcp::socket>;

void write_log(const std::string& path) {
  io::LcmLogWriter writer(path);
  for (const io::LogEvent& event : synthetic_drive(150)) writer.write(event);
  writer.commit();
}

/// The WebSocket of one client whose handshake names the protocol.
Socket accepted(asio::io_context& context, asio::ip::tcp::acceptor& acceptor) {
  Socket socket(acceptor.accept(context));
  beast::flat_buffer buffer;
  beast::http::request<beast::http::string_body> request;
  beast::http::read(socket.next_layer(), buffer, request);
  const auto offered = request[beast::http::field::sec_websocket_protocol];
  const auto chosen =
      web::chosen_subprotocol({offered.data(), offered.size()},
                              {foxglove::kSubprotocols.begin(), foxglove::kSubprotocols.end()});
  if (!chosen) throw std::runtime_error("no subprotocol of ours");
  socket.set_option(
      beast::websocket::stream_base::decorator([chosen](beast::websocket::response_type& response) {
        response.set(beast::http::field::sec_websocket_protocol, *chosen);
      }));
  socket.accept(request);
  return socket;
}

void send_waiting(Socket& socket, foxglove::Session& session) {
  while (const auto out = session.next()) {
    socket.binary(out->is_binary);
    socket.write(asio::buffer(out->bytes));
  }
}

/// Takes messages as they come, whenever the context is run or polled. (How much the system holds
/// does not tell: Beast reads ahead.)
class Receiver {
 public:
  Receiver(Socket& socket, foxglove::Session& session) : socket_(socket), session_(session) {
    start();
  }

 private:
  void start() {
    socket_.async_read(buffer_, [this](const boost::system::error_code& error, std::size_t) {
      if (error) throw boost::system::system_error(error);
      const auto text = beast::buffers_to_string(buffer_.data());
      buffer_.consume(buffer_.size());
      if (socket_.got_text()) {
        session_.take_text(text);
      } else {
        session_.take_binary({reinterpret_cast<const std::uint8_t*>(text.data()), text.size()});
      }
      start();
    });
  }

  Socket& socket_;
  foxglove::Session& session_;
  beast::flat_buffer buffer_;
};

bool has_subscription(const foxglove::Session& session) {
  for (const auto& topic : foxglove::topics()) {
    if (session.is_subscribed(topic.id)) return true;
  }
  return false;
}

void serve(const std::string& log) {
  asio::io_context context;
  asio::ip::tcp::acceptor acceptor(context, {asio::ip::make_address("127.0.0.1"), 0});
  std::cout << acceptor.local_endpoint().port() << std::endl;
  Socket socket = accepted(context, acceptor);

  foxglove::Session session;
  Receiver receiver(socket, session);
  while (!has_subscription(session)) {
    send_waiting(socket, session);
    context.run_one();
  }
  // Until the client goes; never for ever.
  for (int round = 0; round < 1000; ++round) {
    foxglove::Converter converter;
    io::LcmLogReader reader(log);
    while (const auto event = reader.next()) {
      context.poll();
      for (const auto& one : converter.take(event->channel, event->data, event->utime)) {
        session.offer(one);
      }
      bring_up_to_date(session, converter);
      send_waiting(socket, session);
    }
  }
}

}  // namespace
}  // namespace understory::test

int main(int count, char** arguments) {
  const std::string task = count == 3 ? arguments[1] : "";
  try {
    if (task == "log") {
      understory::test::write_log(arguments[2]);
    } else if (task == "serve") {
      understory::test::serve(arguments[2]);
    } else {
      std::cerr << "foxglove_test_peer log OUT.lcm | serve IN.lcm\n";
      return 2;
    }
  } catch (const boost::system::system_error&) {
    return 0;  // The client has gone.
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
