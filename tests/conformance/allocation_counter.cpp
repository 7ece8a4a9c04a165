#include "tests/conformance/allocation_counter.hpp"

#include <cstdlib>
#include <new>

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define TM_COUNTS_ALLOCATIONS 0
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define TM_COUNTS_ALLOCATIONS 0
#endif
#endif
#ifndef TM_COUNTS_ALLOCATIONS
#define TM_COUNTS_ALLOCATIONS 1
#endif

#if TM_COUNTS_ALLOCATIONS

namespace {

thread_local std::uint64_t allocation_count = 0;

}  // namespace

void* operator new(std::size_t size) {
  ++allocation_count;
  if (void* memory = std::malloc(size == 0 ? 1 : size)) {
    return memory;
  }
  throw std::bad_alloc();
}

void operator delete(void* memory) noexcept {
  std::free(memory);
}

void operator delete(void* memory, std::size_t) noexcept {
  std::free(memory);
}

#endif

namespace trigmesh::conformance {

std::optional<std::uint64_t> allocations_of_this_thread() {
#if TM_COUNTS_ALLOCATIONS
  return allocation_count;
#else
  return std::nullopt;
#endif
}

}  // namespace trigmesh::conformance
