#include <gtest/gtest.h>

#include "firmware/daemon/logging.hpp"

namespace trigmesh {
namespace {

/// The programs set up the log before they start threads, and so do these tests.
class LoggingEnvironment : public ::testing::Environment {
 public:
  void SetUp() override { set_up_logging(LogTarget::kStderr, LogLevel::kInfo); }
};

const ::testing::Environment* const environment =
    ::testing::AddGlobalTestEnvironment(new LoggingEnvironment);  // NOLINT: GoogleTest owns it

}  // namespace
}  // namespace trigmesh
