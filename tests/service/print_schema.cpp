// Prints what deploy/skylight.schema.json has to hold.
#include <cstdio>

#include "service/config.hpp"

int main() {
  std::fputs(skylight::service::config_schema().c_str(), stdout);
}
