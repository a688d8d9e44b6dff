// What is recorded of a service, and how it gets into the file; whoever has the session brings the values.
// Layer: server/record.
#pragma once

#include <boost/asio/awaitable.hpp>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "core/session/client/client_session.hpp"
#include "server/record/recording_writer.hpp"

namespace rrgate {

struct RecorderOptions {
  /// Members by the paths of HTTP, with '*' and '?' in the member's name: "state", "axes/0/pos*". All of the root
  /// object: "*". Members that can't be recorded (functions, memories, what is writeonly) are meant by no pattern.
  std::vector<std::string> members = {"*"};
  std::chrono::milliseconds interval{1000};  ///< between two readings of a property
};

/// What those who record hear.
struct RecordListener {
  /// Once: the members of the first connection are followed, or why there is nothing to record.
  std::function<void(const rr::Result<>&)> begun;
  /// What is not recorded; the rest goes on.
  std::function<void(const std::string&)> problem;
  /// A problem that was told is one no more. `left`  the newest of the others; empty: there is none. May be null.
  std::function<void(const std::string& left)> solved = nullptr;
  /// The file can't be written: nothing is recorded any more.
  std::function<void(const rr::Error&)> failed;
};

/// A member that is recorded.
struct RecordedMemberPlace {
  std::string path;   ///< of its object
  std::string place;  ///< the same for people: "axes/0"
  const rr::MemberDefinition* member = nullptr;
  std::uint16_t channel = 0;

  std::string name() const { return place.empty() ? member->name : place + "/" + member->name; }
};

/// Of one service, over all of its connections.
class ServiceRecord : public std::enable_shared_from_this<ServiceRecord> {
 public:
  /// `writer`  outlives close().
  ServiceRecord(RecordingWriter& writer, std::string url, RecorderOptions options, RecordListener listener)
      : writer_(writer), url_(std::move(url)), options_(std::move(options)), listener_(std::move(listener)) {}

  /// Completes with the type of an object, which lives as long as `types` of begin(). Throws   rr::Exception.
  using FindObject = std::function<boost::asio::awaitable<const rr::EntityDefinition*>(std::string path)>;
  struct Choice {
    std::vector<RecordedMemberPlace> members = {};
    bool is_complete = true;  ///< false: a pattern means nothing that is there now
  };
  /// A connection is there, or its objects are others: chooses the members, and adds what the file does not have yet.
  /// Once something was chosen, what is missing is a problem that may go, and no more.
  /// `session`, `types`  are there until this is over.
  /// Throws   rr::Exception: nothing of it can be recorded, and why.
  boost::asio::awaitable<Choice> choose(const rr::ClientSession& session, const rr::TypeRegistry& types,
                                        FindObject find);

  using GetProperty = std::function<boost::asio::awaitable<rr::Value>(const RecordedMemberPlace&)>;
  /// Reads properties again and again, until end_connection(). `types`  outlives it.
  void read_properties(const boost::asio::any_io_executor& executor, const std::vector<RecordedMemberPlace>& properties,
                       std::shared_ptr<const rr::TypeRegistry> types, GetProperty get);
  /// What was begun before comes too late.
  void end_connection() { ++connection_; }
  void close();
  bool is_closed() const { return is_closed_; }

  /// The first call tells the listener.
  void begin(const rr::Result<>& outcome);
  bool has_begun() const { return has_begun_; }
  void write_value(const RecordedMemberPlace& from, const rr::TypeRegistry& types, const rr::Value& value,
                   std::optional<rr::TimeSpec> sent);
  void write_event(const RecordedMemberPlace& from, const rr::TypeRegistry& types, std::span<const rr::Value> values);
  /// Each problem is told once, until there is another at this place, or it is solved.
  void tell_problem(const std::string& where, const std::string& what);
  void solve_problem(const std::string& where);

 private:
  struct Problem {
    std::string what;
    std::uint64_t number = 0;  ///< counts problems
    std::chrono::steady_clock::time_point told;
  };
  struct Schedule;
  boost::asio::awaitable<void> choose_by(std::string pattern, const rr::ClientSession& session, const FindObject& find,
                                         RecordedService& service, std::vector<RecordedMemberPlace>& chosen);
  void expect_known_type(const std::string& path, const rr::EntityDefinition& type) const;
  std::string text_of(const std::string& where, const std::string& what) const;
  void add_to_file(const rr::ClientSession& session, const rr::TypeRegistry& types, RecordedService& service,
                   std::vector<RecordedMemberPlace>& chosen);
  boost::asio::awaitable<void> read_what_is_due(std::shared_ptr<Schedule> schedule);
  void write(const RecordedMemberPlace& from, const rr::OrderedJson& message, std::optional<rr::TimeSpec> sent);
  void handle_value(const RecordedMemberPlace& from);

  RecordingWriter& writer_;
  std::string url_;
  RecorderOptions options_;
  RecordListener listener_;
  std::optional<RecordedService> service_;         ///< once it is in the file
  std::map<std::string, std::uint16_t> channels_;  ///< by place and member
  std::set<std::string> definition_names_;         ///< of service_
  std::map<std::string, Problem> problems_;        ///< told, by where
  std::uint64_t last_problem_ = 0;
  std::uint64_t connection_ = 0;  ///< counts connections
  bool has_begun_ = false;
  bool is_closed_ = false;
};

}  // namespace rrgate
