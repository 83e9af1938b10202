/* Bind servers to the loopback address: bind() to all addresses becomes bind() to 127.0.0.1 or ::1.

   With ROS_HOSTNAME=localhost, rospy and rosmaster listen on this machine only. The XML-RPC server
   of each C++ node, such as rosout and RViz, still listens on all addresses. scripts/fly sets
   LD_PRELOAD to this library; see docs/network.md. */
#define _GNU_SOURCE
#include <dlfcn.h>
#include <netinet/in.h>
#include <string.h>
#include <sys/socket.h>

typedef int (*bind_function)(int, const struct sockaddr *, socklen_t);

int bind(int socket, const struct sockaddr *address, socklen_t length)
{
  bind_function next = (bind_function)dlsym(RTLD_NEXT, "bind");
  struct sockaddr_in v4;
  struct sockaddr_in6 v6;

  if (address && address->sa_family == AF_INET && length >= sizeof v4) {
    memcpy(&v4, address, sizeof v4);
    if (v4.sin_addr.s_addr == htonl(INADDR_ANY)) {
      v4.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
      return next(socket, (const struct sockaddr *)&v4, sizeof v4);
    }
  }
  if (address && address->sa_family == AF_INET6 && length >= sizeof v6) {
    memcpy(&v6, address, sizeof v6);
    if (memcmp(&v6.sin6_addr, &in6addr_any, sizeof in6addr_any) == 0) {
      v6.sin6_addr = in6addr_loopback;
      return next(socket, (const struct sockaddr *)&v6, sizeof v6);
    }
  }
  return next(socket, address, length);
}
