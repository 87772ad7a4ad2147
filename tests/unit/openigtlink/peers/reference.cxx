// A peer of the OpenIGTLink client and server of ntagen, on the reference library in C++.
//
//   reference send PORT      connects, sends one message of each type, and closes
//   reference receive PORT   connects, prints each message as a line, until the stream ends
//   reference serve PORT     waits for a client and for its STT_TDATA, answers, and sends TDATA until
//                            STP_TDATA comes; then it sends a transform, and closes. It listens on
//                            all interfaces: run it in a network namespace.

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include "igtlClientSocket.h"
#include "igtlMessageHeader.h"
#include "igtlOSUtil.h"
#include "igtlPositionMessage.h"
#include "igtlSensorMessage.h"
#include "igtlServerSocket.h"
#include "igtlStatusMessage.h"
#include "igtlStringMessage.h"
#include "igtlTrackingDataMessage.h"
#include "igtlTransformMessage.h"

static void Send(igtl::Socket* socket, igtl::MessageBase* message)
{
  message->Pack();
  socket->Send(message->GetPackPointer(), message->GetPackSize());
}

static void Fill(igtl::Matrix4x4& matrix, float first)
{
  igtl::IdentityMatrix(matrix);
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) matrix[row][column] = first + 3 * column + row;
}

static igtl::TransformMessage::Pointer Transform(float first, unsigned int seconds)
{
  igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
  igtl::Matrix4x4 matrix;
  Fill(matrix, first);
  message->SetDeviceName("Transform");
  message->SetTimeStamp(seconds, seconds ? 0x80000000u : 0u);
  message->SetMatrix(matrix);
  return message;
}

static void SendAll(igtl::Socket* socket)
{
  Send(socket, Transform(1.0f, 7));
  Send(socket, Transform(0.5f, 0));

  igtl::PositionMessage::Pointer position = igtl::PositionMessage::New();
  position->SetDeviceName("Position");
  position->SetPosition(1.0f, 2.0f, 3.0f);
  position->SetQuaternion(0.5f, -0.5f, 0.5f, 0.5f);
  position->SetPackType(igtl::PositionMessage::ALL);
  Send(socket, position);
  // Not without the quaternion: version 1.11 of the library writes beyond its buffer then.

  igtl::TrackingDataMessage::Pointer tracking = igtl::TrackingDataMessage::New();
  tracking->SetDeviceName("Tracker");
  const char* names[] = {"Tip", "Handle"};
  const int types[] = {igtl::TrackingDataElement::TYPE_5D, igtl::TrackingDataElement::TYPE_6D};
  for (int i = 0; i < 2; ++i)
  {
    igtl::TrackingDataElement::Pointer tool = igtl::TrackingDataElement::New();
    igtl::Matrix4x4 matrix;
    Fill(matrix, 10.0f * i);
    tool->SetName(names[i]);
    tool->SetType(types[i]);
    tool->SetMatrix(matrix);
    tracking->AddTrackingDataElement(tool);
  }
  Send(socket, tracking);

  igtl::StatusMessage::Pointer status = igtl::StatusMessage::New();
  status->SetDeviceName("Status");
  status->SetCode(igtl::StatusMessage::STATUS_NOT_READY);
  status->SetSubCode(-5);
  status->SetErrorName("COLD");
  status->SetStatusString("it warms up");
  Send(socket, status);

  igtl::SensorMessage::Pointer sensor = igtl::SensorMessage::New();
  igtl::Unit::Pointer unit = igtl::Unit::New();
  unit->SetPrefix(igtl::Unit::SI_PREFIX_MILLI);
  unit->Append(igtl::Unit::SI_DERIVED_NEWTON, 1);
  sensor->SetDeviceName("Force");
  sensor->SetLength(2);
  sensor->SetUnit(unit);
  sensor->SetValue(0, 250.0);
  sensor->SetValue(1, -1e-3);
  Send(socket, sensor);

  igtl::StringMessage::Pointer text = igtl::StringMessage::New();
  text->SetDeviceName("Text");
  text->SetString("over");
  Send(socket, text);
}

static void Print(const igtl::Matrix4x4& matrix)
{
  for (int column = 0; column < 4; ++column)
    for (int row = 0; row < 3; ++row) std::printf(" %.9g", matrix[row][column]);
}

// Receives the body into a message, and unpacks it; returns whether the checksum is right.
static bool Body(igtl::Socket* socket, igtl::MessageHeader* header, igtl::MessageBase* message)
{
  message->SetMessageHeader(header);
  message->AllocatePack();
  if (message->GetPackBodySize() > 0)
    socket->Receive(message->GetPackBodyPointer(), message->GetPackBodySize());
  return message->Unpack(1) & igtl::MessageHeader::UNPACK_BODY;
}

static void PrintBody(igtl::Socket* socket, igtl::MessageHeader* header)
{
  const std::string type = header->GetDeviceType();
  if (type == "TRANSFORM")
  {
    igtl::TransformMessage::Pointer message = igtl::TransformMessage::New();
    igtl::Matrix4x4 matrix;
    if (!Body(socket, header, message)) { std::printf(" wrong"); return; }
    message->GetMatrix(matrix);
    Print(matrix);
  }
  else if (type == "POSITION")
  {
    igtl::PositionMessage::Pointer message = igtl::PositionMessage::New();
    float p[3], q[4];
    if (!Body(socket, header, message)) { std::printf(" wrong"); return; }
    message->GetPosition(p);
    message->GetQuaternion(q);
    std::printf(" %.9g %.9g %.9g %.9g %.9g %.9g %.9g", p[0], p[1], p[2], q[0], q[1], q[2], q[3]);
  }
  else if (type == "TDATA")
  {
    igtl::TrackingDataMessage::Pointer message = igtl::TrackingDataMessage::New();
    if (!Body(socket, header, message)) { std::printf(" wrong"); return; }
    for (int i = 0; i < message->GetNumberOfTrackingDataElements(); ++i)
    {
      igtl::TrackingDataElement::Pointer tool;
      igtl::Matrix4x4 matrix;
      message->GetTrackingDataElement(i, tool);
      tool->GetMatrix(matrix);
      std::printf(" %s %d", tool->GetName(), tool->GetType());
      Print(matrix);
    }
  }
  else if (type == "STT_TDATA")
  {
    igtl::StartTrackingDataMessage::Pointer message = igtl::StartTrackingDataMessage::New();
    if (!Body(socket, header, message)) { std::printf(" wrong"); return; }
    std::printf(" %d %s", static_cast<int>(message->GetResolution()), message->GetCoordinateName());
  }
  else if (type == "STATUS")
  {
    igtl::StatusMessage::Pointer message = igtl::StatusMessage::New();
    if (!Body(socket, header, message)) { std::printf(" wrong"); return; }
    std::printf(" %d %lld %s %s", message->GetCode(), static_cast<long long>(message->GetSubCode()),
                message->GetErrorName(), message->GetStatusString());
  }
  else if (type == "SENSOR")
  {
    igtl::SensorMessage::Pointer message = igtl::SensorMessage::New();
    igtl::Unit::Pointer unit = igtl::Unit::New();
    if (!Body(socket, header, message)) { std::printf(" wrong"); return; }
    message->GetUnit(unit);
    igtl::igtlUnit packed = unit->Pack();
    std::printf(" %llx", static_cast<unsigned long long>(packed));
    for (unsigned int i = 0; i < message->GetLength(); ++i) std::printf(" %.17g", message->GetValue(i));
  }
  else if (type == "STRING")
  {
    igtl::StringMessage::Pointer message = igtl::StringMessage::New();
    if (!Body(socket, header, message)) { std::printf(" wrong"); return; }
    std::printf(" %s", message->GetString());
  }
  else
  {
    std::printf(" unknown");
    socket->Skip(header->GetBodySizeToRead(), 0);
  }
}

static void ReceiveAll(igtl::Socket* socket)
{
  for (;;)
  {
    igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
    header->InitPack();
    int count = socket->Receive(header->GetPackPointer(), header->GetPackSize());
    if (count != header->GetPackSize()) return;
    header->Unpack();
    unsigned int seconds, fraction;
    header->GetTimeStamp(&seconds, &fraction);
    std::printf("%s %s %u.%08x", header->GetDeviceType(), header->GetDeviceName(), seconds, fraction);
    PrintBody(socket, header);
    std::printf("\n");
    std::fflush(stdout);
  }
}

static int Serve(int port)
{
  igtl::ServerSocket::Pointer server = igtl::ServerSocket::New();
  if (server->CreateServer(port) < 0) return 3;
  std::printf("ready\n");
  std::fflush(stdout);
  igtl::ClientSocket::Pointer client = server->WaitForConnection(10000);
  if (client.IsNull()) return 4;
  igtl::MessageHeader::Pointer header = igtl::MessageHeader::New();
  header->InitPack();
  if (client->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) return 5;
  header->Unpack();
  if (std::strcmp(header->GetDeviceType(), "STT_TDATA") != 0) return 6;
  igtl::StartTrackingDataMessage::Pointer start = igtl::StartTrackingDataMessage::New();
  if (!Body(client, header, start)) return 7;
  std::printf("asked %d %s\n", static_cast<int>(start->GetResolution()), start->GetCoordinateName());
  std::fflush(stdout);

  igtl::RTSTrackingDataMessage::Pointer reply = igtl::RTSTrackingDataMessage::New();
  reply->SetStatus(igtl::RTSTrackingDataMessage::STATUS_SUCCESS);
  Send(client, reply);
  client->SetReceiveTimeout(start->GetResolution());
  for (int i = 0; i < 2000; ++i)
  {
    igtl::TrackingDataMessage::Pointer tracking = igtl::TrackingDataMessage::New();
    igtl::TrackingDataElement::Pointer tool = igtl::TrackingDataElement::New();
    igtl::Matrix4x4 matrix;
    igtl::IdentityMatrix(matrix);
    matrix[0][3] = static_cast<float>(i);
    tool->SetName("Tip");
    tool->SetType(igtl::TrackingDataElement::TYPE_5D);
    tool->SetMatrix(matrix);
    tracking->SetDeviceName("Tracker");
    tracking->AddTrackingDataElement(tool);
    Send(client, tracking);
    header->InitPack();
    if (client->Receive(header->GetPackPointer(), header->GetPackSize()) != header->GetPackSize()) continue;
    header->Unpack();
    std::printf("%s\n", header->GetDeviceType());
    break;
  }
  client->CloseSocket();
  return 0;
}

int main(int argc, char** argv)
{
  if (argc < 3) return 2;
  const std::string mode = argv[1];
  const int port = std::atoi(argv[2]);
  if (mode == "serve") return Serve(port);
  igtl::ClientSocket::Pointer socket = igtl::ClientSocket::New();
  if (socket->ConnectToServer("127.0.0.1", port) != 0) return 3;
  if (mode == "send") SendAll(socket);
  else ReceiveAll(socket);
  socket->CloseSocket();
  return 0;
}
