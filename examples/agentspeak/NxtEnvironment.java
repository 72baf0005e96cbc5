import jason.asSyntax.ASSyntax;
import jason.asSyntax.Literal;
import jason.asSyntax.Structure;
import jason.environment.Environment;

import java.io.BufferedReader;
import java.io.IOException;
import java.io.InputStreamReader;
import java.net.Socket;
import java.nio.charset.StandardCharsets;
import java.util.logging.Level;

/** `nxtdrive serve` as Jason's environment: tcp_write(Request) sends a line; the answer becomes the percept received(N). */
public class NxtEnvironment extends Environment {

    private static final Literal ANY_REPLY = Literal.parseLiteral("received(_)");

    private Socket socket;
    private BufferedReader replies;

    /** Connects; the arguments are host and port. */
    @Override
    public void init(String[] args) {
        try {
            socket = new Socket(args[0], Integer.parseInt(args[1]));
            replies = new BufferedReader(new InputStreamReader(socket.getInputStream(), StandardCharsets.UTF_8));
        } catch (IOException error) {
            throw new IllegalStateException("no `nxtdrive serve` at " + args[0] + ":" + args[1], error);
        }
    }

    /** Runs in a thread of the environment: the agent's other intentions go on while the robot moves. */
    @Override
    public boolean executeAction(String agent, Structure action) {
        if (!action.getFunctor().equals("tcp_write") || action.getArity() != 1) {
            return false;
        }
        try {
            int reply = ask(action.getTerm(0).toString());
            removePerceptsByUnif(agent, ANY_REPLY);
            addPercept(agent, ASSyntax.createLiteral("received", ASSyntax.createNumber(reply)));
            return true;
        } catch (IOException | NumberFormatException error) {
            getLogger().log(Level.SEVERE, "no answer from `nxtdrive serve`", error);
            return false;
        }
    }

    /** Hanging up stops the robot's motors. */
    @Override
    public void stop() {
        try {
            socket.close();
        } catch (IOException error) {
            getLogger().log(Level.FINE, "closed already", error);
        }
        super.stop();
    }

    private synchronized int ask(String request) throws IOException {
        socket.getOutputStream().write((request + "\n").getBytes(StandardCharsets.UTF_8));
        String reply = replies.readLine();
        if (reply == null) {
            throw new IOException("the server has hung up");
        }
        return Integer.parseInt(reply.trim());
    }
}
