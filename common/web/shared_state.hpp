// Data shared by the sockets' thread and the owner of a server.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "common/web/server.hpp"

namespace understory::web {

/// Events, documents and counts, each access is locked for the time of a copy.
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
  /// Takes all events; the file is then no longer readable.
  std::vector<Event> take();

  /// Sets the response to GET of `path`.
  void set_document(const std::string& path, Document document);
  /// The document of a path; null = none.
  std::shared_ptr<const Document> document(const std::string& path) const;

  /// Adds 1 to a count.
  void count(std::uint64_t ServerCounts::*which);
  /// A copy of the counts.
  ServerCounts counts() const;

 private:
  mutable std::mutex mutex_;
  int event_file_ = -1;
  std::vector<Event> events_;
  std::map<std::string, std::shared_ptr<const Document>> documents_;
  ServerCounts counts_;
};

}  // namespace understory::web
