// What the thread of the sockets and the owner of a server share.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/web/server.hpp"

namespace understory::web {

/// Events, documents and counts, each access locked for as long as a copy takes.
class SharedState {
 public:
  SharedState();
  ~SharedState();
  SharedState(const SharedState&) = delete;
  SharedState& operator=(const SharedState&) = delete;

  /// Readable when there are events.
  int file_descriptor() const { return event_file_; }
  /// Adds an event and makes the file readable.
  void push(Event event);
  /// Takes all events; the file is readable no more.
  std::vector<Event> take();

  /// What GET of `path` gives.
  void set_document(const std::string& path, Document document);
  /// Null where there is none.
  std::shared_ptr<const Document> document(const std::string& path) const;

  /// Adds 1 to a count.
  void count(std::uint64_t ServerCounts::*which);
  /// A copy.
  ServerCounts counts() const;

 private:
  mutable std::mutex mutex_;
  int event_file_ = -1;
  std::vector<Event> events_;
  std::map<std::string, std::shared_ptr<const Document>> documents_;
  ServerCounts counts_;
};

}  // namespace understory::web
